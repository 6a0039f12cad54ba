"""Contact sheets of key frames: all cameras' images round the exact raster."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.labels.definition import Definition
from ogmkit.labels.map_mask import grid_spec
from ogmkit.labels.names import PAPER, SURROUND
from ogmkit.labels.plane import plane_of
from ogmkit.pictures import legend
from ogmkit.pictures.bev_panel import draw_plane, plan_for
from ogmkit.pictures.camera_panel import draw_camera
from ogmkit.pictures.canvas import PAGE, Canvas, text_width
from ogmkit.pictures.cells import target_colours
from ogmkit.pictures.sheet import GAP, Heading, Panel, draw_sheet, draw_tile
from ogmkit.pictures.views import View, evenly, read_view
from ogmkit.samples.surround import frames_by_row, require_poses
from ogmkit.samples.surround_reading import key_frame_of, seen_cells
from ogmkit.shards import schema_labels
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard
from ogmkit.typing import UInt8Array

VIEW = "surround"
PHOTO, PLANE = (225, 400), (462, 500)
"""Largest (height, width) of an image and of the raster between them."""
_NAME_SIZE = 16
_MIDDLE = PHOTO[1] + GAP, PHOTO[0] + GAP
_RIGHT, _BELOW = PHOTO[1] + PLANE[1] + 2 * GAP, PHOTO[0] + PLANE[0] + 2 * GAP
_AHEAD, _LOWER = PHOTO[0] + GAP, 2 * (PHOTO[0] + GAP)
_PLACES = {
    "CAM_FRONT": (_MIDDLE[0] + (PLANE[1] - PHOTO[1]) // 2, 0),
    "CAM_FRONT_LEFT": (0, _AHEAD),
    "CAM_FRONT_RIGHT": (_RIGHT, _AHEAD),
    "CAM_BACK_LEFT": (0, _LOWER),
    "CAM_BACK_RIGHT": (_RIGHT, _LOWER),
    "CAM_BACK": (_MIDDLE[0] + (PLANE[1] - PHOTO[1]) // 2, _BELOW),
}
"""Camera → left and top of its image, in pixels; others are not shown."""


@dataclass(frozen=True, eq=False)
class _Moment:
    """A key frame: its place among the samples, its cameras' views, and colours of the raster's cells."""

    row: int
    views: dict[str, View]
    colours: UInt8Array


def draw_surround(shard: Shard, frames: int, dataroot: Path | None = None) -> UInt8Array:
    """Draw a scene's contact sheet: (h, w, 3) uint8 RGB.

    Args:
        shard: an open shard.
        frames: how many key frames, evenly spread.
        dataroot: where images are found that the shard only refers to; None leaves them out.

    Raises:
        SettingsError: the shard has no labels `surround`.
        ShardError, DataFileError: as of `ogmkit.pictures.views.read_view`.
    """
    definition = next((one for one in shard.settings.labels if one.name == SURROUND), None)
    if definition is None:
        raise SettingsError(
            f"{shard.path}: has no labels {SURROUND}; extract with --definition {PAPER},{SURROUND}"
        )
    require_poses(shard, REMEDY)
    count = shard.frames(schema_labels.SURROUND)
    frame_of = frames_by_row(shard, shard.cameras)
    tiles = [
        _tile(_moment(shard, definition, (row, frame_of[row]), dataroot), definition)
        for row in evenly(frames, count)
    ]
    grid = grid_spec(definition.grid)
    note = f"{shard.location} · {shard.dataset_version} · {count} key frames · "
    note += f"{grid.rows} by {grid.columns} cells of {grid.m_per_cell:g} m"
    heading = Heading(shard.scene, schema_labels.SURROUND, note)
    return draw_sheet(heading, tiles, 2, (legend.PLANE, legend.BOXES))


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
    """The images round the raster."""
    canvas = Canvas(_BELOW + PHOTO[0], _RIGHT + PHOTO[1], PAGE)
    plane = draw_plane(moment.colours, plan_for(grid_spec(definition.grid), (), PLANE))
    height, width = plane.shape
    canvas.paste(plane.pixels, _MIDDLE[0] + (PLANE[1] - width) // 2, _MIDDLE[1] + (PLANE[0] - height) // 2)
    for camera, view in moment.views.items():
        if camera in _PLACES:
            photo = draw_camera(view, PHOTO)
            photo.fill(0, 0, text_width(camera, _NAME_SIZE) + 16, 26, PAGE)
            photo.text(camera, 8, 19, _NAME_SIZE)
            left, top = _PLACES[camera]
            canvas.paste(photo.pixels, left + (PHOTO[1] - photo.shape[1]) // 2, top)
    return draw_tile([Panel(canvas.pixels, f"key frame {moment.row}")])
