"""The plane from above: cells in their colours, the ego, its past and its future."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.pictures.canvas import GREEN, MUTED, OUTLINE, PAGE, SKY_BLUE, TEXT, Canvas, Colour, resize
from ogmkit.pictures.views import View
from ogmkit.typing import FloatArray, UInt8Array

PAST_COLOUR: Colour = SKY_BLUE
FUTURE_COLOUR: Colour = GREEN
EGO_COLOUR: Colour = TEXT
EGO_SHAPE = np.array([[0.0, -12.0], [8.0, 9.0], [0.0, 4.0], [-8.0, 9.0]])
"""Corners of the ego's arrow in pixels, its tip up."""
DOT_RADIUS = 4.0

_BEHIND_M = (10.0, 62.0)  # room for the scale bar; 3 s at 20 m/s and the last dot
_BAR_LENGTHS_M = (100, 50, 20, 10, 5, 2, 1)


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
        return self.grid_size[0] + round(self.behind_m * self.px_per_m), self.grid_size[1]

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
    return Plan(grid, min(size[0] / height_m, size[1] / width_m), behind_m)


def draw_plane(colours: UInt8Array, plan: Plan) -> Canvas:
    """Draw the grid, forward up and left to the left, with a scale bar and the ego.

    Args:
        colours: (rows, columns, 3) uint8 RGB of the cells.
        plan: where it goes.
    """
    canvas = Canvas(*plan.size, PAGE)
    canvas.paste(resize(colours, plan.grid_size), 0, 0)
    _draw_scale_bar(canvas, plan.px_per_m)
    _draw_ego(canvas, plan)
    return canvas


def draw_paths(canvas: Canvas, view: View, plan: Plan) -> None:
    """Draw past and future on a plane, under the ego."""
    ego = np.zeros((1, 2))
    past, future = (points[~np.isnan(points).any(axis=1)] for points in (view.past, view.future))
    canvas.polyline(plan.pixels(np.concatenate([past, ego])), PAST_COLOUR)
    canvas.polyline(plan.pixels(np.concatenate([ego, future])), FUTURE_COLOUR)
    canvas.dots(plan.pixels(past), PAST_COLOUR, DOT_RADIUS)
    canvas.dots(plan.pixels(future), FUTURE_COLOUR, DOT_RADIUS)
    _draw_ego(canvas, plan)


def _draw_ego(canvas: Canvas, plan: Plan) -> None:
    canvas.polygon(plan.pixels(np.zeros((1, 2))) + EGO_SHAPE, EGO_COLOUR)


def _draw_scale_bar(canvas: Canvas, px_per_m: float) -> None:
    """Draw a bar of a round length in two halves, at the lower left."""
    height, width = canvas.shape
    length_m = next((m for m in _BAR_LENGTHS_M if m * px_per_m <= 0.45 * width), _BAR_LENGTHS_M[-1])
    half = round(length_m * px_per_m / 2)
    left, top = 12, height - 16
    canvas.fill(left, top, half, 4, TEXT)
    canvas.fill(left + half, top, half, 4, OUTLINE)
    canvas.text(f"{length_m} m", left, top - 8, 18, MUTED)
