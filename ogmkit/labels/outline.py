"""Lines in whole numbers: what a drawing routine paints of an edge (Bresenham, 1965).

The rule is OpenCV's of 3.x to 4.7, written down in docs/definitions.md; later versions draw other cells.
"""

import numpy as np

from ogmkit.raster.ranges import ranges
from ogmkit.typing import BoolArray, FloatArray, IntArray

Segments = tuple[IntArray, IntArray, IntArray, IntArray]
"""(S,) x and y of one end, x and y of the other."""


def line_cells(starts: IntArray, ends: IntArray, shape: tuple[int, int]) -> tuple[IntArray, IntArray]:
    """Cells of 8-connected lines, clipped to an array.

    Args:
        starts: (S, 2) int64 (column, row).
        ends: (S, 2).
        shape: (rows, columns).

    Returns:
        (C,) which line each cell is of, rising, and (C,) row · columns + column.
    """
    clipped, kept = clip(starts, ends, (shape[1] - 1, shape[0] - 1))
    x1, y1, x2, y2 = clipped
    reverse = x1 > x2
    x, y = np.where(reverse, x2, x1), np.where(reverse, y2, y1)
    dx, dy = np.abs(x2 - x1), np.where(reverse, y1, y2) - np.where(reverse, y2, y1)
    steep = np.abs(dy) > dx
    major, minor = np.where(steep, np.abs(dy), dx), np.where(steep, dx, np.abs(dy))
    line = np.repeat(np.arange(len(x)), major + 1)
    step = ranges(np.zeros_like(major), major + 1)
    # The error term falls by 2·minor a point and gains 2·major where it has become negative: in closed form.
    aside = -((major[line] - 2 * minor[line] * step) // np.maximum(2 * major[line], 1))
    aside = np.where(major[line] > 0, np.maximum(aside, 0), 0)
    along_x, along_y = np.where(steep[line], aside, step), np.where(steep[line], step, aside)
    cells = (y[line] + np.sign(dy)[line] * along_y) * shape[1] + x[line] + along_x
    return kept[line], cells


def clip(starts: IntArray, ends: IntArray, last: tuple[int, int]) -> tuple[Segments, IntArray]:
    """Cut lines off outside [0, last], in whole numbers: top and bottom first, end 1 before end 2.

    Args:
        starts: (S, 2) int64 (x, y).
        ends: (S, 2).
        last: greatest x and y inside.

    Returns:
        Both ends of the lines that are left, and (L,) which these are.
    """
    x1, y1 = (starts[:, axis].copy() for axis in range(2))
    x2, y2 = (ends[:, axis].copy() for axis in range(2))
    kept = np.flatnonzero(~_beyond(x1, x2, last[0]) & ~_beyond(y1, y2, last[1]))
    x1, y1, x2, y2 = (values[kept] for values in (x1, y1, x2, y2))
    _pull(y1, x1, y2, x2, last[1])
    _pull(y2, x2, y1, x1, last[1])
    inside = ~_beyond(x1, x2, last[0])
    x1, y1, x2, y2, kept = (values[inside] for values in (x1, y1, x2, y2, kept))
    _pull(x1, y1, x2, y2, last[0])
    _pull(x2, y2, x1, y1, last[0])
    return (x1, y1, x2, y2), kept


def _beyond(one: IntArray, other: IntArray, last: int) -> BoolArray:
    """Where both ends lie on the same outer side."""
    return ((one < 0) & (other < 0)) | ((one > last) & (other > last))


def _pull(own: IntArray, cross: IntArray, other: IntArray, other_cross: IntArray, last: int) -> None:
    """Move one end along its line to the border of one axis, where it lies outside; in place."""
    rows = np.flatnonzero((own < 0) | (own > last))
    border = np.where(own[rows] < 0, 0, last)
    cross[rows] += truncated(
        (border - own[rows]).astype(np.float64) * (other_cross[rows] - cross[rows]),
        other[rows] - own[rows],
    )
    own[rows] = border


def truncated(numerator: FloatArray, denominator: IntArray) -> IntArray:
    """A quotient cut toward zero, by way of float64."""
    result: IntArray = np.trunc(numerator / denominator).astype(np.int64)
    return result
