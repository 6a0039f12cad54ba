"""Planning with a trained run: sequence by sequence, as arrays that need no torch to be read."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.learn.data.index import index_sequences
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.inference import Run, predict_batch, require_cameras, require_grid, require_planner
from ogmkit.learn.plan import Plan, PlannedFrame
from ogmkit.learn.systems.base import Batch, System
from ogmkit.typing import FloatArray


def predict_plans(
    run: Run,
    shards: Path,
    scenes: Sequence[str],
    cameras: Sequence[str],
    *,
    homography: str | None = None,
    batch_size: int = 8,
    workers: int = 0,
    limit: int | None = None,
) -> Iterator[PlannedFrame]:
    """Plan from every sequence of some scenes that has a valid trajectory and no gap.

    Where one of its images has no valid homography, its masks are warped to nothing.

    Args:
        run: of a planner.
        shards: a folder that an extraction finished.
        scenes: names.
        cameras: channels.
        homography: source that masks are warped by; None is the one that the run was trained with.
        batch_size: sequences at a time.
        workers: processes that read.
        limit: sequences at most, evenly spread; None for all.

    Yields:
        Plans in the order of scenes, cameras and time.

    Raises:
        CheckpointError: the run plans nothing, or what is not finite.
        SettingsError: the grids differ, or the run doesn't know a camera.
        ShardError: the shards lack what the run predicts from.
        TrainingError: there is no such sequence.
    """
    require_planner(run)
    require_grid(run, shards)
    require_cameras(run, cameras)
    spec = run.model.prediction_spec(homography)
    index = index_sequences(shards, scenes, cameras, needs=spec, valid_only=False, limit=limit)
    dataset = SequenceDataset(index, spec)
    batches = EpochBatches(len(dataset), batch_size, seed=0, shuffle=False)
    for batch in loader(dataset, batches, workers=workers):
        places = [dataset.place(int(i)) for i in batch["index"]]
        for place, plan in zip(places, predict_plan_batch(run.model, batch, dataset.cameras), strict=True):
            scene, camera, frame = place
            require_finite_plan(run, plan, f"{scene} {camera} frame {frame}")
            yield PlannedFrame(scene, camera, frame, plan)


def require_finite_plan(run: Run, plan: Plan, place: str) -> None:
    """Refuse a plan that is none: JSON knows no NaN, and means would hide it.

    Raises:
        CheckpointError: it holds a number that is not finite.
    """
    if not all(np.isfinite(part).all() for part in (plan.mean, plan.sigma, plan.rho)):
        raise CheckpointError(
            f"{run.checkpoint}: its plan for {place} is not finite; choose another, or train again"
        )


def predict_plan_batch(model: System, batch: Batch, cameras: tuple[str, ...]) -> list[Plan]:
    """Plan from samples whose `camera`, if they have one, counts in `cameras`.

    Args:
        model: a planner.
        batch: collated sequence samples of what the model predicts from.
        cameras: channels.

    Raises:
        SettingsError: the model plans nothing, or was not trained on one of the cameras.
        OgmkitError: the GPU's memory is too small for the batch.
    """
    found = predict_batch(model, batch, cameras).plan
    if found is None:
        raise SettingsError(f"{model.settings.system} plans nothing")
    mean, sigma, rho = (_array(value.double().cpu().numpy()) for value in found)
    return [Plan(*parts) for parts in zip(mean, sigma, rho, strict=True)]


def _array(values: object) -> FloatArray:
    return np.asarray(values, dtype=np.float64)
