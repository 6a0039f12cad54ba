"""The plane from above: cells in their colours, the ego, its past and its future."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ogmkit.drawing.canvas import Canvas, resize
from ogmkit.drawing.palette import theme
from ogmkit.grid import GridSpec
from ogmkit.typing import FloatArray, UInt8Array

EGO_SHAPE = np.array([[0.0, -12.0], [8.0, 9.0], [0.0, 4.0], [-8.0, 9.0]])
"""Corners of the ego's arrow in pixels, its tip up."""
DOT_RADIUS = 4.0
FOOTER = 34
"""Pixels below a plane, for its scale bar: no path leads there."""

_BEHIND_M = (4.0, 62.0)  # the ego's arrow; 3 s at 20 m/s and the last dot
_BAR_LENGTHS_M = (100, 50, 20, 10, 5, 2, 1)
_BAR_SHARE = 0.45


@dataclass(frozen=True)
class Plan:
    """A drawing of the level frame's plane: the grid, and a strip below it for what lies behind.

    Attributes:
        grid: the rasters' grid.
        px_per_m: scale.
        behind_m: length of the strip.
    """

    grid: GridSpec
    px_per_m: float
    behind_m: float

    @property
    def grid_size(self) -> tuple[int, int]:
        """(height, width) of the grid in pixels."""
        per_cell = self.px_per_m * self.grid.m_per_cell
        return max(1, round(self.grid.rows * per_cell)), max(1, round(self.grid.columns * per_cell))

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the drawing in pixels."""
        height, width = self.grid_size
        return height + round(self.behind_m * self.px_per_m) + FOOTER, width

    def pixels(self, points_level: FloatArray) -> FloatArray:
        """Pixels (x, y) of (K, 2) points in metres, level frame."""
        farthest, leftmost = self.grid.x_range_m[1], self.grid.y_range_m[1]
        from_corner_m = np.array([leftmost, farthest]) - points_level[:, ::-1]
        pixels: FloatArray = from_corner_m * self.px_per_m - 0.5
        return pixels


def plan_for(grid: GridSpec, pasts: Sequence[FloatArray], size: tuple[int, int]) -> Plan:
    """The largest plan of the grid within (height, width) pixels.

    Args:
        grid: the rasters' grid.
        pasts: (6, 2) metres each, level frame; the strip behind holds the longest of them, within limits.
        size: in pixels.
    """
    behind_m = grid.x_range_m[0] - min(
        (float(np.nanmin(past[:, 0], initial=0.0)) for past in pasts), default=0
    )
    behind_m = float(np.clip(behind_m + 2.0, *_BEHIND_M))
    height_m, width_m = grid.rows * grid.m_per_cell + behind_m, grid.columns * grid.m_per_cell
    return Plan(grid, min((size[0] - FOOTER) / height_m, size[1] / width_m), behind_m)


def draw_plane(colours: UInt8Array, plan: Plan) -> Canvas:
    """Draw the grid, forward up and left to the left, with a scale bar and the ego.

    Args:
        colours: (rows, columns, 3) uint8 RGB of the cells.
        plan: where it goes.
    """
    canvas = Canvas(*plan.size)
    canvas.paste(resize(colours, plan.grid_size), 0, 0)
    canvas.frame(*plan.grid_size, theme().line)
    _draw_scale_bar(canvas, plan.px_per_m)
    _draw_ego(canvas, plan)
    return canvas


def draw_paths(canvas: Canvas, past: FloatArray, future: FloatArray, plan: Plan) -> None:
    """Draw (K, 2) past and future on a plane: lines below vehicles, points as rings, the ego on top."""
    ego, bare = np.zeros((1, 2)), canvas.pixels.copy()
    past, future = (points[~np.isnan(points).any(axis=1)] for points in (past, future))
    colours = theme()
    with footer_kept(canvas):
        draw_line(canvas, plan.pixels(np.concatenate([past, ego])), colours.first)
        draw_line(canvas, plan.pixels(np.concatenate([ego, future])), colours.future)
        canvas.rings(plan.pixels(past), colours.first, DOT_RADIUS, bare)
        canvas.rings(plan.pixels(future), colours.future, DOT_RADIUS, bare)
        _draw_ego(canvas, plan)


@contextmanager
def footer_kept(canvas: Canvas) -> Iterator[None]:
    """Whatever is drawn inside ends above the scale bar."""
    footer = canvas.pixels[-FOOTER:].copy()
    yield
    canvas.pixels[-FOOTER:] = footer


def draw_line(canvas: Canvas, points: FloatArray, colour: tuple[int, int, int]) -> None:
    """Join (K, 2) pixels by a line that leaves what has the vehicles' colour as it is."""
    vehicles = (canvas.pixels == theme().vehicle).all(axis=2)
    before = canvas.pixels[vehicles]
    canvas.cased_polyline(points, colour)
    canvas.pixels[vehicles] = before


def _draw_ego(canvas: Canvas, plan: Plan) -> None:
    shape = plan.pixels(np.zeros((1, 2))) + EGO_SHAPE
    canvas.polygon(shape, theme().text)
    canvas.polyline(np.concatenate([shape, shape[:1]]), theme().page, 1)


def _draw_scale_bar(canvas: Canvas, px_per_m: float) -> None:
    """Draw a bar of a round length in two halves at the left of the footer, its length beside it."""
    height, width = canvas.shape
    longest = _BAR_SHARE * width
    length_m = next((m for m in _BAR_LENGTHS_M if m * px_per_m <= longest), _BAR_LENGTHS_M[-1])
    half, top = round(length_m * px_per_m / 2), height - FOOTER // 2
    canvas.fill(0, top, half, 4, theme().text)
    canvas.fill(half, top, half, 4, theme().muted)
    canvas.text(f"{length_m} m", 2 * half + 10, top + 8, 18, theme().muted)
