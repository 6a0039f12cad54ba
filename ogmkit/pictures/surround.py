"""Contact sheets of key frames: all cameras' images round the exact raster."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import FOOTER, draw_plane, plan_for
from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.cells import target_colours
from ogmkit.drawing.palette import themed
from ogmkit.drawing.sheet import CAPTION, GAP, Heading, Panel, draw_sheet, draw_tile
from ogmkit.errors import SettingsError
from ogmkit.labels.definition import Definition
from ogmkit.labels.map_mask import grid_spec
from ogmkit.labels.names import PAPER, SURROUND
from ogmkit.labels.plane import plane_of
from ogmkit.pictures.camera_panel import draw_camera
from ogmkit.pictures.settings import PreviewSettings
from ogmkit.pictures.views import View, evenly, read_view
from ogmkit.samples.surround import frames_by_row, require_poses
from ogmkit.samples.surround_reading import key_frame_of, seen_cells
from ogmkit.shards import schema_labels
from ogmkit.shards.faults import REMEDY, damaged
from ogmkit.shards.reader import Shard
from ogmkit.typing import UInt8Array

VIEW = "surround"
PHOTO, PLANE = (225, 400), (498 + FOOTER, 500)
"""Largest (height, width) of an image and of the raster between them."""
_TITLED, _PLANE_TITLED = CAPTION + PHOTO[0], CAPTION + PLANE[0]
_MIDDLE = PHOTO[1] + GAP
_CENTRE, _RIGHT = _MIDDLE + (PLANE[1] - PHOTO[1]) // 2, _MIDDLE + PLANE[1] + GAP
_AHEAD, _LOWER = _TITLED + GAP, 2 * (_TITLED + GAP)
_BELOW = _AHEAD + _PLANE_TITLED + GAP
_PLACES = {
    "CAM_FRONT": (_CENTRE, 0),
    "CAM_FRONT_LEFT": (0, _AHEAD),
    "CAM_FRONT_RIGHT": (_RIGHT, _AHEAD),
    "CAM_BACK_LEFT": (0, _LOWER),
    "CAM_BACK_RIGHT": (_RIGHT, _LOWER),
    "CAM_BACK": (_CENTRE, _BELOW),
}
"""Camera → left and top of its image with its title, in pixels; others are not shown."""


@dataclass(frozen=True, eq=False)
class _Moment:
    """A key frame: its place among the samples, its cameras' views, and colours of the raster's cells."""

    row: int
    views: dict[str, View]
    colours: UInt8Array


def draw_surround(shard: Shard, settings: PreviewSettings, dataroot: Path | None = None) -> UInt8Array:
    """Draw a scene's contact sheet: (h, w, 3) uint8 RGB.

    Args:
        shard: an open shard.
        settings: how many key frames, evenly spread, and the theme.
        dataroot: where images are found that the shard only refers to; None leaves them out.

    Raises:
        SettingsError: the shard has no labels `surround`.
        ShardError: the shard lacks something, or a part of it is damaged.
        DataFileError: as of `ogmkit.pictures.views.read_view`.
    """
    definition = next((one for one in shard.settings.labels if one.name == SURROUND), None)
    if definition is None:
        raise SettingsError(
            f"{shard.path}: has no labels {SURROUND}; extract with --definition {PAPER},{SURROUND}"
        )
    require_poses(shard, REMEDY)
    try:
        with themed(settings.theme):
            tiles = [*_tiles(shard, definition, settings.frames, dataroot)]
            heading = Heading(shard.scene, schema_labels.SURROUND, _note(shard, definition))
            return draw_sheet(heading, tiles, 2, (legend.PLANE, legend.BOXES))
    except OSError as error:
        raise damaged(shard.path, error) from error


def _tiles(shard: Shard, definition: Definition, frames: int, dataroot: Path | None) -> Iterator[UInt8Array]:
    frame_of = frames_by_row(shard, shard.cameras)
    for row in evenly(frames, shard.frames(schema_labels.SURROUND)):
        yield _tile(_moment(shard, definition, (row, frame_of[row]), dataroot), definition)


def _note(shard: Shard, definition: Definition) -> str:
    grid = grid_spec(definition.grid)
    parts = (
        shard.location,
        shard.dataset_version,
        f"{shard.frames(schema_labels.SURROUND)} key frames",
        f"{grid.rows} by {grid.columns} cells of {grid.m_per_cell:g} m",
    )
    return " · ".join(parts)


def _moment(
    shard: Shard, definition: Definition, sample: tuple[int, dict[str, int]], dataroot: Path | None
) -> _Moment:
    row, frame_of = sample
    views = {camera: read_view(shard, camera, frame, dataroot=dataroot) for camera, frame in frame_of.items()}
    group = f"{schema_labels.LABELS}/{definition.name}"
    rasters = {
        name: shard.dataset(schema_labels.SURROUND, f"{group}/{name}")[row] for name in definition.class_names
    }
    vehicles = rasters["vehicles"]
    drivable = rasters.get("drivable", np.zeros_like(vehicles))
    seen = _seen(shard, definition, row, frame_of)
    return _Moment(row, views, target_colours(drivable, vehicles, seen))


def _seen(shard: Shard, definition: Definition, row: int, frame_of: dict[str, int]) -> UInt8Array:
    """(rows, columns) whether an image shows the cell."""
    key_frame = key_frame_of(shard, row)
    plane = plane_of(definition.frame, key_frame)
    reference_from_global = plane.in_space(key_frame.global_from_ego[:3, 3])
    seen = np.zeros(definition.grid.shape, np.uint8)
    for camera, frame in frame_of.items():
        names = ("global_from_ego", "ego_from_camera", "intrinsics", "image_size")
        to_global, to_ego, intrinsics, size = (shard.dataset(camera, name)[frame] for name in names)
        pose = reference_from_global @ to_global @ to_ego
        seen |= seen_cells(definition, intrinsics[None], pose[None], (int(size[0]), int(size[1])))
    return seen


def _tile(moment: _Moment, definition: Definition) -> UInt8Array:
    """The images round the raster, each below its title; no higher than what there is."""
    plane = _titled(draw_plane(moment.colours, plan_for(grid_spec(definition.grid), (), PLANE)), "from above")
    placed = [(plane, _MIDDLE + (PLANE[1] - plane.shape[1]) // 2, _AHEAD)]
    for camera, view in moment.views.items():
        if camera in _PLACES:
            photo = _titled(draw_camera(view, PHOTO), camera)
            left, top = _PLACES[camera]
            placed.append((photo, left + (PHOTO[1] - photo.shape[1]) // 2, top))
    first = min(top for _, _, top in placed)
    last = max(top + picture.shape[0] for picture, _, top in placed)
    canvas = Canvas(last - first, _RIGHT + PHOTO[1])
    for picture, left, top in placed:
        canvas.paste(picture, left, top - first)
    return _titled(canvas, f"key frame {moment.row}")


def _titled(picture: Canvas, title: str) -> UInt8Array:
    return draw_tile([Panel(picture.pixels, title)])
