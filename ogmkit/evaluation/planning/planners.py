"""Trained planners as rows of the table: opened, checked, named, and asked for their plans."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.errors import CheckpointError
from ogmkit.evaluation.entrants import names_of, require_fitting
from ogmkit.evaluation.planning.sequences import Sequences
from ogmkit.evaluation.progress import Tick
from ogmkit.evaluation.runs import OpenRun
from ogmkit.evaluation.scope import invalid_homographies, require_homography
from ogmkit.metrics.plan import Plan
from ogmkit.samples.requirements import require_same_step


@dataclass(frozen=True)
class Planner:
    """A run.

    Attributes:
        name: in the table.
        run: opened.
        homography: the source that it warps by; None for a planner that warps nothing.
        note: what to read with its row.
    """

    name: str
    run: OpenRun
    homography: str | None
    note: str


def planners_of(
    runs: Sequence[OpenRun],
    shards: Path,
    sequences: Sequences,
    *,
    homography: str | None,
    reserved: Sequence[str],
) -> tuple[Planner, ...]:
    """Check that runs can be evaluated, and name them.

    Args:
        runs: opened.
        shards: what they are evaluated on.
        sequences: what they are evaluated on there.
        homography: the source that planners warp by; None is each one's own.
        reserved: names of other rows.

    Raises:
        CheckpointError: one doesn't plan.
        SettingsError: a run is given twice, was trained on another grid or step or without one of the
            cameras, or not all shards have the homography.
        ShardError: a shard is absent or damaged.
    """
    index = sequences.index
    invalid = invalid_homographies(index)
    if homography is not None:
        require_homography(shards, sequences.split, invalid, homography)
    require_fitting(runs, shards, index.grid, index.cameras)
    sources: list[str | None] = []
    for run in runs:
        if run.output != "plan":
            raise CheckpointError(f"{run.path}: {run.system} plans nothing: `evaluate` scores it")
        require_same_step(run.path, run.step_s, index.step_s)
        source = run.warps_by(homography)
        if source is not None:
            require_homography(shards, sequences.split, invalid, source)
        sources.append(source)
    names = names_of([run.path for run in runs], [run.name for run in runs], reserved)
    return tuple(
        Planner(name, run, source, _note(name, run.path, source, invalid, len(index)))
        for name, run, source in zip(names, runs, sources, strict=True)
    )


def plans_of(
    planner: Planner, sequences: Sequences, *, batch_size: int, workers: int, tick: Tick
) -> tuple[Plan, ...]:
    """What a run plans for every sequence, in order.

    Raises:
        OgmkitError: as `ogmkit.learn.predict.plans.inference.predict_plans`.
    """
    plans: list[Plan] = []
    found = planner.run.plans(sequences.index, planner.homography, batch_size=batch_size, workers=workers)
    for one in found:
        plans.append(one.plan)
        tick()
    return tuple(plans)


def _note(name: str, path: Path, source: str | None, invalid: dict[str, int], sequences: int) -> str:
    if source is None:
        return f"{name}: {path}"
    warped = f"{name}: {path}, masks warped by homography {source}"
    if not invalid[source]:
        return warped
    return f"{warped}; {invalid[source]} of {sequences} sequences have images without one: empty there"
