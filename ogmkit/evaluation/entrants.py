"""Trained runs as rows of a table: opened, checked and named."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.differences import differences
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.evaluation.runs import OpenRun
from ogmkit.evaluation.scope import PREFERRED, Scope, masks_problem
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.shards.remedies import homography_command


@dataclass(frozen=True)
class Entrant:
    """A run.

    Attributes:
        name: in the table.
        run: opened.
        masks: the set of camera-view masks that it is compared with there; None where it predicts none, or
            the shards lack them.
        note: what to read with its row.
    """

    name: str
    run: OpenRun
    masks: str | None
    note: str


def entrants_of(runs: Sequence[OpenRun], scope: Scope, reserved: Sequence[str]) -> tuple[Entrant, ...]:
    """Check that runs can be evaluated, and name them.

    Args:
        runs: opened.
        scope: what they are evaluated on.
        reserved: names of other rows.

    Raises:
        CheckpointError: one predicts no grids.
        SettingsError: a run is given twice, was trained on another grid or without one of the cameras, or
            needs a homography that the shards lack.
    """
    require_fitting(runs, scope.shards, scope.grid, scope.index.cameras)
    for run in runs:
        _require_grids(run, scope)
    masks = {run.masks for run in runs if run.masks is not None}
    problems = {name: masks_problem(scope.shards, scope.index, name) for name in masks}
    names = names_of([run.path for run in runs], [run.system for run in runs], reserved)
    return tuple(
        Entrant(name, run, None, f"{name}: {run.path}")
        if run.masks is None
        else _masked_entrant(name, run, run.masks, problems[run.masks])
        for name, run in zip(names, runs, strict=True)
    )


def require_fitting(runs: Sequence[OpenRun], shards: Path, grid: GridSpec, cameras: Sequence[str]) -> None:
    """Refuse runs that can't be evaluated on some shards.

    Args:
        runs: opened.
        shards: what they are evaluated on.
        grid: the shards'.
        cameras: channels that they are evaluated on.

    Raises:
        SettingsError: a run is given twice, or was trained on another grid or without one of the cameras.
    """
    checkpoints: dict[Path, Path] = {}
    for run in runs:
        different = differences({"grid": vars(run.grid)}, {"grid": vars(grid)})
        if different:
            raise SettingsError(
                f"{run.path}: was trained on another grid than {shards} has: {', '.join(different)}; "
                "evaluate on shards of its grid"
            )
        strange = [camera for camera in cameras if camera not in run.cameras]
        if strange:
            raise SettingsError(
                f"{run.path}: was trained without {strange[0]}; choose --camera {','.join(run.cameras)}"
            )
        checkpoint = run.checkpoint.resolve()
        if checkpoint in checkpoints:
            raise SettingsError(
                f"{run.path}: is the same checkpoint as {checkpoints[checkpoint]}; give it once"
            )
        checkpoints[checkpoint] = run.path


def names_of(runs: Sequence[Path], systems: Sequence[str], reserved: Sequence[str]) -> tuple[str, ...]:
    """Names that differ: the system's; where several share it, of the path as much from its end as it takes.

    Args:
        runs: paths, all different.
        systems: of each.
        reserved: names that no run may have.
    """
    counts = Counter(systems)
    taken = {*reserved, *(system for system in systems if counts[system] == 1)}
    resolved = [path.resolve() for path in runs]
    shared = [path.parts for path, system in zip(resolved, systems, strict=True) if counts[system] > 1]

    def name_of(path: Path, system: str) -> str:
        if counts[system] == 1:
            return system
        # Files of checkpoints are called alike: with their folder, they say more.
        for length in range(1 + path.is_file(), len(path.parts)):
            tail = path.parts[-length:]
            alike = sum(parts[-length:] == tail for parts in shared)
            if alike == 1 and "/".join(tail) not in taken:
                return "/".join(tail)
        return str(path)

    return tuple(name_of(path, system) for path, system in zip(resolved, systems, strict=True))


def _masked_entrant(name: str, run: OpenRun, masks: str, problem: str) -> Entrant:
    """A run that predicts masks in camera view."""
    if problem:
        note = f"{name}: {run.path}, trained on masks {masks!r}; no figures in camera view: {problem}"
        return Entrant(name, run, None, note)
    note = f"{name}: {run.path}, trained on masks {masks!r}, and compared with them in camera view"
    return Entrant(name, run, masks, note)


def _require_grids(run: OpenRun, scope: Scope) -> None:
    """Refuse a run that can't be evaluated on the scope."""
    if run.output != "grids":
        raise no_grids(run.path, run.system, scope.shards)
    if run.masks is not None and scope.homography is None:
        fit = f"run `{homography_command(scope.shards, PREFERRED[-1])}`"
        known = f"choose --homography {' or '.join(scope.invalid)}" if scope.invalid else fit
        raise SettingsError(f"{scope.shards}: has no homography {' or '.join(PREFERRED)}; {known}")


def no_grids(path: Path, system: str, shards: Path) -> CheckpointError:
    """What to raise of a run that predicts no occupancy grids."""
    if CATALOGUE[system].plans:
        return CheckpointError(f"{path}: {system} predicts no grids, it plans: `evaluate_plans` scores it")
    command = f"ogmkit predict {system} {shards} --checkpoint {path}"
    return CheckpointError(
        f"{path}: {system} predicts no grids; evaluate another RUN by what `{command}` adds to the shards: "
        "--homography network"
    )
