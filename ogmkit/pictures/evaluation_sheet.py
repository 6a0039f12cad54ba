"""Predictions beside the truth, as in the paper's Fig. 4: one PNG for each run."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ogmkit.base.atomic import output_errors, require_outside
from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import Plan, draw_plane, plan_for
from ogmkit.drawing.cells import agreement_colours, target_colours
from ogmkit.drawing.png import write_png
from ogmkit.drawing.sheet import Caption, Heading, Panel, draw_sheet, draw_tile
from ogmkit.errors import ShardError
from ogmkit.evaluation.result import Evaluation, Sample
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.metrics.iou import code_of, masks_of
from ogmkit.pictures.camera_panel import draw_masks, draw_photo
from ogmkit.pictures.subjects import PLANE_SIZE, photo_size, scores_text
from ogmkit.pictures.views import View, read_view
from ogmkit.pipeline.footprint_masks import renderer
from ogmkit.shards.faults import REMEDY, damaged
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.typing import UInt8Array

_GROUPS = legend.PLANE, legend.DRIVABLE, legend.VEHICLES


def make_folder(pictures: Path, shards: Path) -> None:
    """Make the folder for pictures.

    Raises:
        OutputError: it lies in the folder of shards, or can't be made.
    """
    require_outside(pictures, shards)
    with output_errors(pictures):
        pictures.mkdir(parents=True, exist_ok=True)


def draw_evaluation(shards: Path, evaluation: Evaluation, pictures: Path) -> tuple[Path, ...]:
    """Draw the samples that an evaluation kept.

    Args:
        shards: the folder that was evaluated on.
        evaluation: with samples.
        pictures: where the PNGs go, a folder; those of an earlier run are replaced.

    Returns:
        The files written, one a run.

    Raises:
        ShardError, DataFileError: what is drawn can't be read.
        OutputError: a file can't be written.
    """
    manifest, written = read_manifest(shards), []
    for name in evaluation.systems:
        samples = [sample for sample in evaluation.samples if sample.system == name]
        tiles = [_draw_sample(shards, manifest, sample) for sample in samples]
        path = pictures / f"{quote(name, safe=' +,=@')}.png"  # a name may hold a part of a path
        write_png(path, draw_sheet(Heading(name, "", _note(evaluation)), tiles, 1, _GROUPS))
        written.append(path)
    return tuple(written)


def _note(evaluation: Evaluation) -> str:
    parts = [f"split {evaluation.split}", f"threshold {evaluation.threshold:g}"]
    if evaluation.homography is not None:
        parts.insert(1, f"homography {evaluation.homography}")
    return " · ".join([*parts, "each prediction beside the truth, and where they differ"])


def _draw_sample(shards: Path, manifest: Manifest, sample: Sample) -> UInt8Array:
    """One frame: masks over the image, then prediction and truth of each target."""
    scene, camera, index = sample.place
    (entry,) = (one for one in manifest.shards if one.scene == scene)
    dataroot = Path(manifest.dataroot) if manifest.settings.targets.images == "reference" else None
    try:
        with listed_shard(shards, entry) as shard:
            view = read_view(shard, camera, index, dataroot=dataroot)
            image = _true_masks(shard, camera, index) if sample.image is None else sample.image
            plan = plan_for(shard.grid, (), PLANE_SIZE)
    except OSError as error:
        raise damaged(shards / entry.file, error) from error
    drivable, vehicles = masks_of(image)
    size, found = photo_size(plan), masks_of(sample.bev)
    photo = draw_masks(view, size, drivable=drivable, vehicles=vehicles)
    whose = "true footprints" if sample.image is None else "predicted masks"
    photos = [Panel(draw_photo(view, size).pixels, "image"), Panel(photo.pixels, whose)]
    caption = Caption(f"{scene} · frame {index}", camera, f"IoU in view: {scores_text(view, found)}")
    return draw_tile([photos, *_planes(view, plan, found)], caption)


def _true_masks(shard: Shard, camera: str, index: int) -> UInt8Array:
    """(height, width) code of exact footprints, for systems that predict none."""
    made = renderer(shard, camera, FootprintSettings(method="project", scale=1.0))(index)
    if made is None:
        raise ShardError(f"{shard.path}: {camera}: frame {index} gives no footprints; {REMEDY}")
    return code_of(made.drivable, made.vehicles)


def _planes(view: View, plan: Plan, found: tuple[UInt8Array, UInt8Array]) -> Iterator[Panel]:
    """Prediction, truth, and where each target differs."""
    kinds = {
        "predicted": target_colours(*found, view.field_of_view),
        "truth": target_colours(view.drivable, view.vehicles, view.field_of_view),
    }
    for title, colours in kinds.items():
        yield Panel(draw_plane(colours, plan).pixels, title)
    for target, pixels in differences(view, plan, found).items():
        yield Panel(pixels, f"{target}, difference")


def differences(view: View, plan: Plan, found: tuple[UInt8Array, UInt8Array]) -> Mapping[str, UInt8Array]:
    """Where a prediction differs from the truth, target by target; of vehicles on ground that says nothing.

    Args:
        view: the frame.
        plan: where the planes go.
        found: (rows, columns) predicted drivable area and vehicles, uint8 0/1.

    Returns:
        Target → (h, w, 3) uint8 RGB.
    """
    nothing = np.zeros_like(view.vehicles)
    drivable, vehicles = found
    kinds = {
        "drivable": ((view.drivable, nothing), (drivable, nothing)),
        "vehicles": ((nothing, view.vehicles), (nothing, vehicles)),
    }
    return {
        target: draw_plane(agreement_colours(true, other, view.field_of_view), plan).pixels
        for target, (true, other) in kinds.items()
    }
