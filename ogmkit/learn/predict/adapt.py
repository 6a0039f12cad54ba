"""A trained network adapted to images without labels: statistics of its batch normalisation, nothing else."""

import dataclasses
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from ogmkit.base.atomic import output_errors, replacing, write_json
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import CheckpointError, OgmkitError, SettingsError
from ogmkit.learn.adaptation import Adaptation
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import KEY, write_checkpoint
from ogmkit.learn.choices import common_cameras
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.tensors import as_float
from ogmkit.learn.devices import device_name
from ogmkit.learn.models.recalibration import batch_norms, recalibrating
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.image_folder import IMAGES, PlainImages, inputs_in
from ogmkit.learn.predict.run import Run, open_run
from ogmkit.learn.runs import ADAPTED, BEST, CONFIG, SPLITS, require_vacant, scenes_of
from ogmkit.learn.yaml_files import as_yaml
from ogmkit.samples.index import index_frames
from ogmkit.shards.manifest import NAME, read_manifest

_FEWEST = 2
"""Images of a batch: a map of one pixel has no spread of its own."""


@dataclass(frozen=True)
class AdaptSummary:
    """What was done.

    Attributes:
        system: of the network.
        layers: of batch normalisation, whose statistics are new.
        images: that they come from.
        seconds: wall time.
    """

    system: str
    layers: int
    images: int
    seconds: float


def adapt(
    checkpoint: Path,
    source: Path,
    out: Path,
    *,
    choice: Choice | None = None,
    share: float = 1.0,
    batch_size: int = 8,
    workers: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> AdaptSummary:
    """Take the statistics of a network's batch normalisation from images, of which nothing else is read.

    Batches are drawn at random, always the same ones; images that fill no whole batch are left out.

    Args:
        checkpoint: a RUN folder, whose best checkpoint is used, or a checkpoint.
        source: a folder of shards, or of *.jpg and *.png.
        out: folder of the new RUN.
        choice: which frames of shards; all by default.
        share: of the images' statistics in the new ones, over 0 and up to 1; the run's own have the rest.
        batch_size: images at a time.
        workers: processes that read.
        on_progress: called with (images done, images in all).

    Raises:
        CheckpointError: there is no checkpoint, it is damaged, or its network sees no images or has no batch
            normalisation.
        SettingsError: a scene, split or camera is unknown, there is one image only, the share is out of
            range, or the network needs more than images.
        ShardError: the shards are no finished extraction, or have no images.
        DataFileError: an image is absent or damaged.
        OutputError: `out` holds something, or can't be written.
    """
    started = time.monotonic()
    if not 0 < share <= 1:
        raise SettingsError(f"share must be over 0 and at most 1, not {share}")
    run = open_run(checkpoint)
    layers = _require_adaptable(run)
    require_vacant(out)
    images, scenes = _images(run, source, choice or Choice())
    size = min(batch_size, len(images))
    if size < _FEWEST:
        raise SettingsError(f"{source}: statistics of a single image are none; give at least {_FEWEST}")
    tell(Found(f"{with_number(len(images), 'image')}; {run.path} on {device_name()}"))
    batches = EpochBatches(len(images), size, seed=0, shuffle=True, drop_last=True)
    with recalibrating(run.model, share), torch.inference_mode():
        for done, batch in enumerate(loader(images, batches, workers=workers), start=1):
            _look(run, batch)
            if on_progress is not None:
                on_progress(done * size, len(batches) * size)
    made = Adaptation(str(run.path), run.sha256, str(source), scenes, len(batches) * size, share)
    _write(run, out, made)
    return AdaptSummary(run.system, layers, made.images, time.monotonic() - started)


def _require_adaptable(run: Run) -> int:
    """How many layers a run's network has that can be adapted.

    Raises:
        CheckpointError: none.
    """
    if CATALOGUE[run.system].inputs != "images":
        raise CheckpointError(f"{run.path}: {run.system} sees no images; there is nothing to adapt")
    layers = batch_norms(run.model)
    if not layers:
        raise CheckpointError(
            f"{run.path}: its network has no batch normalisation; there is nothing to adapt"
        )
    return len(layers)


def _images(run: Run, source: Path, choice: Choice) -> tuple[FrameDataset | PlainImages, tuple[str, ...]]:
    """The images, and the names of the scenes that they come from."""
    spec = run.model.image_spec
    if (source / NAME).is_file():
        manifest = read_manifest(source)
        scenes = choice.scenes_of(source, manifest)
        cameras = common_cameras(run.path, run.cameras, source, manifest, choice.cameras)
        index = index_frames(source, scenes, cameras, needs=spec, valid_only=False, limit=choice.limit)
        return FrameDataset(index, spec, compact=True), scenes
    if spec.calibration:
        raise SettingsError(f"{source}: {run.system} needs each camera's calibration; give shards")
    if choice != Choice():
        raise SettingsError(f"{source}: holds no shards, of which scenes, splits or cameras could be chosen")
    return PlainImages(inputs_in(source, IMAGES), run.image_size), ()


def _look(run: Run, batch: dict[str, Tensor]) -> None:
    model = run.model
    try:
        model.look(as_float({name: value.to(model.device) for name, value in batch.items()}))
    except torch.OutOfMemoryError as error:
        raise OgmkitError(f"the GPU's memory is full: use a smaller --batch-size ({error})") from error


def _write(run: Run, out: Path, made: Adaptation) -> None:
    """The new RUN; its checkpoint last, by which it is one."""
    with output_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    with replacing(out / CONFIG) as part:
        part.write_text(as_yaml(run.card.settings), encoding="utf-8")
    known = {ADAPTED: made.scenes} if made.scenes else {}
    scenes = scenes_of(run.checkpoint) | known
    if scenes:
        write_json(out / SPLITS, scenes)
    card = dataclasses.replace(run.card, adapted=made)
    weights = {name: value.cpu() for name, value in run.model.state_dict().items()}
    write_checkpoint(out / BEST, {"state_dict": weights, KEY: card.to_dict()})
