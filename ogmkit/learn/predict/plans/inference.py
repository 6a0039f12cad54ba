"""Planning with a trained run: sequence by sequence, as arrays that need no torch to be read."""

from collections.abc import Iterator

import numpy as np

from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.predict.frames import predict_batch, require_fitting
from ogmkit.learn.predict.run import Run, require_planner
from ogmkit.learn.systems.base import Batch, System
from ogmkit.metrics.plan import Plan, PlannedFrame
from ogmkit.samples.index import FrameIndex
from ogmkit.samples.spec import SampleSpec
from ogmkit.typing import FloatArray


def predict_plans(
    run: Run, index: FrameIndex, spec: SampleSpec, *, batch_size: int = 8, workers: int = 0
) -> Iterator[PlannedFrame]:
    """Plan from every sequence of an index, in order.

    Where one of its images has no valid homography, its masks are warped to nothing.

    Args:
        run: of a planner.
        index: of sequences of the run's grid.
        spec: what the run plans from, as its `model.prediction_spec` says.
        batch_size: sequences at a time.
        workers: processes that read.

    Raises:
        CheckpointError: the run plans nothing, or what is not finite.
        SettingsError: the grids differ, or the run doesn't know a camera.
        ShardError: the shards lack what the run predicts from.
    """
    require_planner(run)
    require_fitting(run, index, spec)
    dataset = SequenceDataset(index, spec, compact=True)
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
