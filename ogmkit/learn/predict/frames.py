"""Frames predicted by a trained run, as arrays that need no torch to be read."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from ogmkit.errors import OgmkitError
from ogmkit.geometry.camera import image_from_resized
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import EpochBatches, SceneBatches, loader
from ogmkit.learn.data.tensors import as_float
from ogmkit.learn.predict.run import Run, require_cameras, require_same_grid
from ogmkit.learn.systems.base import Batch, Prediction, System
from ogmkit.samples.index import FrameIndex
from ogmkit.samples.requirements import require_extracted
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import read_manifest
from ogmkit.typing import Float32Array, FloatArray


@dataclass(frozen=True, eq=False)
class FramePrediction:
    """What a run says of one frame.

    Attributes:
        scene: the scene's name.
        camera: channel.
        frame: place among the camera's frames in the scene, from 0.
        bev: (2, rows, columns) float32 probabilities on the shards' grid, drivable then vehicles; None for a
            system without, or where no homography was asked for.
        image: (2, h, w) float32 probabilities at the network's image size; None for a system without.
        bev_from_image: (3, 3) float64 from pixels of the image as the shard has it, of any scale; None for a
            system without.
    """

    scene: str
    camera: str
    frame: int
    bev: Float32Array | None
    image: Float32Array | None
    bev_from_image: FloatArray | None


def predict_frames(
    run: Run,
    index: FrameIndex,
    spec: SampleSpec,
    *,
    batch_size: int = 8,
    workers: int = 0,
    by_scene: bool = False,
) -> Iterator[FramePrediction]:
    """Predict every frame of an index, in order; a frame without a homography has an empty `bev`.

    Args:
        run: an opened run.
        index: of frames of the run's grid.
        spec: what the run predicts from, as its `model.prediction_spec` says.
        batch_size: frames at a time.
        workers: processes that read.
        by_scene: let no batch go beyond its scene, so that a scene's predictions are those of an index of
            that scene alone.

    Raises:
        SettingsError: the grids differ, or the run doesn't know a camera.
        ShardError: the shards lack what the run predicts from.
        CheckpointError: the weights are not this system's.
    """
    require_fitting(run, index, spec)
    dataset = FrameDataset(index, spec, compact=True)
    batches = (
        SceneBatches([len(scene) for scene in index.by_scene()], batch_size)
        if by_scene
        else EpochBatches(len(dataset), batch_size, seed=0, shuffle=False)
    )
    for batch in loader(dataset, batches, workers=workers):
        yield from _frames(run, dataset, batch)


def of_both(drivable: FramePrediction, vehicles: FramePrediction) -> FramePrediction:
    """One frame by two homographies: of the first, the drivable area, of the second, the vehicles."""
    if drivable.bev is None or vehicles.bev is None:
        return drivable
    return replace(drivable, bev=np.stack([drivable.bev[0], vehicles.bev[1]]))


def require_fitting(run: Run, index: FrameIndex, spec: SampleSpec) -> None:
    """Refuse samples that a run can't predict from.

    Raises:
        SettingsError: the grids differ, or the run doesn't know a camera.
        ShardError: images or LiDAR points were not extracted.
    """
    shards = index.paths[0].parent
    require_same_grid(run, index.grid, shards)
    require_cameras(run, index.cameras)
    require_extracted(shards, read_manifest(shards), spec)


def _frames(run: Run, dataset: FrameDataset, batch: Batch) -> Iterator[FramePrediction]:
    found = predict_batch(run.model, batch, dataset.cameras)
    places = [dataset.place(int(index)) for index in batch["index"]]
    homographies = None if found.bev_from_image is None else found.bev_from_image.cpu().numpy()
    for number, (scene, camera, frame) in enumerate(places):
        bev_from_image = None
        if homographies is not None:
            source_size = dataset.source_size(int(batch["index"][number]))
            resized_from_image = image_from_resized(run.image_size, source_size)
            bev_from_image = homographies[number] @ resized_from_image
        bev, image = _array(found.bev, number), _array(found.image, number)
        yield FramePrediction(scene, camera, frame, bev, image, bev_from_image)


def predict_batch(model: System, batch: Batch, cameras: tuple[str, ...]) -> Prediction:
    """Predict from samples whose `camera` counts in `cameras`; results are on the model's device.

    Raises:
        SettingsError: the model was not trained on one of the cameras.
        OgmkitError: the GPU's memory is too small for the batch.
    """
    try:
        here = as_float({name: value.to(model.device) for name, value in batch.items()})
        if "camera" in here:
            here["camera"] = model.camera_indices(here, cameras)
        with torch.inference_mode():
            return model.predict(here)
    except torch.OutOfMemoryError as error:
        raise OgmkitError(f"the GPU's memory is full: use a smaller --batch-size ({error})") from error


def _array(maps: Tensor | None, number: int) -> Float32Array | None:
    return None if maps is None else np.asarray(maps[number].float().cpu().numpy(), dtype=np.float32)
