"""Trained runs as rows of a table: opened, checked and named."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ogmkit.base.differences import differences
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.evaluation.scope import PREFERRED, Scope, paths
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE, Output
from ogmkit.shards import schema
from ogmkit.shards.crosschecks_added import origin_problem
from ogmkit.shards.reader import Shard
from ogmkit.shards.remedies import footprints_command, homography_command

if TYPE_CHECKING:
    from ogmkit.learn.inference import FramePrediction, Run


@dataclass(frozen=True)
class Entrant:
    """A run.

    Attributes:
        name: in the table.
        path: its folder or checkpoint.
        masks: the set of camera-view masks that it is compared with there; None where it predicts none, or
            the shards lack them.
        note: what to read with its row.
    """

    name: str
    path: Path
    masks: str | None
    note: str


def open_entrants(runs: Sequence[Path], scope: Scope, reserved: Sequence[str]) -> tuple[Entrant, ...]:
    """Open each run once, check that it can be evaluated, and name it.

    Networks are let go again: only one at a time is held later.

    Args:
        runs: folders or checkpoints.
        scope: what they are evaluated on.
        reserved: names of other rows.

    Raises:
        CheckpointError: there is none, it is damaged, or predicts no grids.
        SettingsError: a run is given twice, was trained on another grid or without one of the cameras, or
            needs a homography that the shards lack.
    """
    systems: list[str] = []
    sets: list[str | None] = []
    for path, run in open_each(runs, scope.shards, scope.grid, scope.index.cameras):
        _require_fit(run, path, scope)
        systems.append(run.system)
        sets.append(run.masks)
    problems = {masks: masks_problem(scope, masks) for masks in sets if masks is not None}
    names = names_of(runs, systems, reserved)
    return tuple(
        Entrant(name, path, None, f"{name}: {path}")
        if masks is None
        else _masked_entrant(name, path, masks, problems[masks])
        for name, path, masks in zip(names, runs, sets, strict=True)
    )


def open_each(
    runs: Sequence[Path], shards: Path, grid: GridSpec, cameras: Sequence[str]
) -> Iterator[tuple[Path, "Run"]]:
    """Open runs one after the other, each checked against the shards.

    Args:
        runs: folders or checkpoints.
        shards: what they are evaluated on.
        grid: the shards'.
        cameras: channels that they are evaluated on.

    Raises:
        CheckpointError: there is none, or it is damaged.
        SettingsError: a run is given twice, or was trained on another grid or without one of the cameras.
    """
    from ogmkit.learn.inference import open_run  # noqa: PLC0415  # torch only where there are runs

    checkpoints: dict[Path, Path] = {}
    for path in runs:
        run = open_run(path)
        different = differences({"grid": vars(run.grid)}, {"grid": vars(grid)})
        if different:
            raise SettingsError(
                f"{path}: was trained on another grid than {shards} has: {', '.join(different)}; "
                "evaluate on shards of its grid"
            )
        strange = [camera for camera in cameras if camera not in run.cameras]
        if strange:
            raise SettingsError(
                f"{path}: was trained without {strange[0]}; choose --camera {' --camera '.join(run.cameras)}"
            )
        checkpoint = run.checkpoint.resolve()
        if checkpoint in checkpoints:
            raise SettingsError(f"{path}: is the same checkpoint as {checkpoints[checkpoint]}; give it once")
        checkpoints[checkpoint] = path
        yield path, run


@dataclass(frozen=True)
class ByStage:
    """Runs by the table that they belong to, each in the order given.

    Attributes:
        perceiving: they predict grids: the first table.
        planning: they plan: the second table.
        untabled: they predict homographies, which have no table of their own.
    """

    perceiving: tuple[Path, ...]
    planning: tuple[Path, ...]
    untabled: tuple[Path, ...]


def by_stage(runs: Sequence[Path]) -> ByStage:
    """Sort runs by what their checkpoints say; no network is built.

    Raises:
        CheckpointError: there is no checkpoint, or it is damaged.
    """
    from ogmkit.learn.checkpoints import checkpoint_file, read_checkpoint  # noqa: PLC0415  # it loads torch

    systems = {path: read_checkpoint(checkpoint_file(path))[0].settings.system for path in runs}

    def predicting(output: Output) -> tuple[Path, ...]:
        return tuple(path for path in runs if CATALOGUE[systems[path]].output == output)

    return ByStage(predicting("grids"), predicting("plan"), predicting("homography"))


def predictions(
    entrant: Entrant, scope: Scope, *, batch_size: int, workers: int, limit: int | None
) -> Iterator["FramePrediction"]:
    """What a run says of every frame of the scope.

    Raises:
        OgmkitError: as `ogmkit.learn.inference.predict_frames`.
    """
    from ogmkit.learn.inference import open_run, predict_frames  # noqa: PLC0415

    index = scope.index
    yield from predict_frames(
        open_run(entrant.path),
        scope.shards,
        index.scenes,
        index.cameras,
        homography=scope.homography,
        batch_size=batch_size,
        workers=workers,
        limit=limit,
    )


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


def masks_problem(scope: Scope, name: str) -> str:
    """Why a set of camera-view masks can't serve as truth; empty where it can."""
    for path in paths(scope.index).values():
        with Shard(path) as shard:
            for camera in scope.index.cameras:
                if name not in shard.added(camera, schema.FOOTPRINTS.name):
                    command = footprints_command(scope.shards, name)
                    return f"{path.name}: {camera} has no footprints {name!r}: run `{command}`"
                problem = origin_problem(shard, camera, name)
                if problem:
                    return f"{path.name}: {camera}/footprints/{name} {problem}"
    return ""


def _masked_entrant(name: str, path: Path, masks: str, problem: str) -> Entrant:
    """A run that predicts masks in camera view."""
    if problem:
        note = f"{name}: {path}, trained on masks {masks!r}; no figures in camera view: {problem}"
        return Entrant(name, path, None, note)
    note = f"{name}: {path}, trained on masks {masks!r}, and compared with them in camera view"
    return Entrant(name, path, masks, note)


def _require_fit(run: "Run", path: Path, scope: Scope) -> None:
    """Refuse a run that can't be evaluated on the scope."""
    if not run.model.has_bev:
        raise no_grids(path, run.system, scope.shards)
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
