"""Trained planners as rows of the table: opened, checked, named, and asked for their plans."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.errors import CheckpointError
from ogmkit.evaluation.entrants import names_of, open_each
from ogmkit.evaluation.planning.sequences import Sequences
from ogmkit.evaluation.progress import Tick
from ogmkit.evaluation.scope import invalid_homographies, require_homography
from ogmkit.learn.data.index import SEQUENCE
from ogmkit.learn.plan import Plan


@dataclass(frozen=True)
class Planner:
    """A run.

    Attributes:
        name: in the table.
        path: its folder or checkpoint.
        homography: the source that it warps by; None for a planner that warps nothing.
        note: what to read with its row.
    """

    name: str
    path: Path
    homography: str | None
    note: str


def open_planners(
    runs: Sequence[Path],
    shards: Path,
    split: str,
    sequences: Sequences,
    *,
    homography: str | None,
    reserved: Sequence[str],
) -> tuple[Planner, ...]:
    """Open each run once, check that it can be evaluated, and name it.

    Args:
        runs: folders or checkpoints.
        shards: what they are evaluated on.
        split: its split.
        sequences: of the split.
        homography: the source that planners warp by; None is each one's own.
        reserved: names of other rows.

    Raises:
        CheckpointError: there is none, it is damaged, or doesn't plan.
        SettingsError: a run is given twice, was trained on another grid or without one of the cameras, or
            not all shards have the homography.
        ShardError: a shard is absent or damaged.
    """
    index = sequences.index
    invalid = invalid_homographies(index, SEQUENCE)
    if homography is not None:
        require_homography(shards, split, invalid, homography)
    names: list[str] = []
    sources: list[str | None] = []
    for path, run in open_each(runs, shards, index.grid, index.cameras):
        if not run.model.plans:
            raise CheckpointError(f"{path}: {run.system} plans nothing: `evaluate` scores it")
        source = run.model.prediction_spec(homography).homography
        if source is not None:
            require_homography(shards, split, invalid, source)
        names.append(run.name)
        sources.append(source)
    return tuple(
        Planner(name, path, source, _note(name, path, source, invalid, len(index)))
        for name, path, source in zip(names_of(runs, names, reserved), runs, sources, strict=True)
    )


def plans_of(
    planner: Planner,
    shards: Path,
    sequences: Sequences,
    *,
    batch_size: int,
    workers: int,
    limit: int | None,
    tick: Tick,
) -> tuple[Plan, ...]:
    """What a run plans for every sequence, in order.

    Raises:
        OgmkitError: as `ogmkit.learn.plans.inference.predict_plans`.
    """
    from ogmkit.learn.inference import open_run  # noqa: PLC0415  # torch only where there are runs
    from ogmkit.learn.plans.inference import predict_plans  # noqa: PLC0415

    index = sequences.index
    plans: list[Plan] = []
    for found in predict_plans(
        open_run(planner.path),
        shards,
        index.scenes,
        index.cameras,
        homography=planner.homography,
        batch_size=batch_size,
        workers=workers,
        limit=limit,
    ):
        plans.append(found.plan)
        tick()
    return tuple(plans)


def _note(name: str, path: Path, source: str | None, invalid: dict[str, int], sequences: int) -> str:
    if source is None:
        return f"{name}: {path}"
    warped = f"{name}: {path}, masks warped by homography {source}"
    if not invalid[source]:
        return warped
    return f"{warped}; {invalid[source]} of {sequences} sequences have images without one: empty there"
