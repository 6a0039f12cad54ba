"""A contact sheet: frames of one camera as tiles, each with its picture beside the plane from above."""

from collections.abc import Sequence

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.pictures.bev_panel import Plan, draw_plane, plan_for
from ogmkit.pictures.camera_panel import draw_camera
from ogmkit.pictures.canvas import MUTED, Canvas, fit
from ogmkit.pictures.legend import TEXT_SIZE, draw_legend
from ogmkit.pictures.views import View
from ogmkit.typing import UInt8Array

CAMERA_SIZE = 540, 960
PLANE_SIZE = 540, 960

_MARGIN, _GAP, _TILE_GAP = 40, 12, 36
_HEADER, _CAPTION = 104, 44
_TITLE_SIZE = 40


def draw_sheet(scene: str, camera: str, note: str, grid: GridSpec, views: Sequence[View]) -> UInt8Array:
    """Draw frames of one camera in reading order: up to two below each other, more in two columns.

    Args:
        scene: stands large at the top left, and beside it:
        camera: the channel.
        note: stands small below them.
        grid: the rasters' grid.
        views: at least one frame.

    Returns:
        (h, w, 3) uint8 RGB.
    """
    plan = plan_for(grid, views, PLANE_SIZE)
    camera_height, camera_width = (max(sides) for sides in zip(*map(_camera_size, views), strict=True))
    tile_height = _CAPTION + max(camera_height, plan.size[0])
    tile_width = camera_width + _GAP + plan.size[1]
    columns = 1 if len(views) <= 2 else 2
    rows = -(-len(views) // columns)
    legend = draw_legend(columns * (tile_width + _TILE_GAP) - _TILE_GAP)
    top = _MARGIN + _HEADER
    bottom = top + rows * (tile_height + _TILE_GAP)
    canvas = Canvas(bottom + legend.shape[0] + _MARGIN // 2, legend.shape[1] + 2 * _MARGIN)
    _draw_header(canvas, scene, camera, note)
    for place, view in enumerate(views):
        row, column = divmod(place, columns)
        left = _MARGIN + column * (tile_width + _TILE_GAP)
        tile = Canvas(tile_height, tile_width)
        _draw_tile(tile, view, plan, camera_width + _GAP)
        canvas.paste(tile.pixels, left, top + row * (tile_height + _TILE_GAP))
    canvas.paste(legend, _MARGIN, bottom)
    return canvas.pixels


def _draw_header(canvas: Canvas, scene: str, camera: str, note: str) -> None:
    taken = canvas.text(scene, _MARGIN, _MARGIN + 32, _TITLE_SIZE)
    canvas.text(camera, _MARGIN + taken + 20, _MARGIN + 32, _TITLE_SIZE, MUTED)
    canvas.text(note, _MARGIN, _MARGIN + 72, TEXT_SIZE, MUTED)


def _camera_size(view: View) -> tuple[int, int]:
    return fit(view.image_size, CAMERA_SIZE)


def _draw_tile(tile: Canvas, view: View, plan: Plan, plane_left: int) -> None:
    """Draw one frame: a caption, and below it the camera's picture and the plane."""
    tile.paste(draw_camera(view, CAMERA_SIZE).pixels, 0, _CAPTION)
    tile.paste(draw_plane(view, plan).pixels, plane_left, _CAPTION)
    baseline = _CAPTION - 12
    taken = tile.text(f"{view.time_s:.1f} s", 0, baseline, TEXT_SIZE)
    tile.text(f"frame {view.index}", taken + 14, baseline, TEXT_SIZE, MUTED)
    if np.isnan([view.past, view.future]).any():
        tile.text("trajectory incomplete", tile.shape[1], baseline, TEXT_SIZE, MUTED, "right")
