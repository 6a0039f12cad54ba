"""Lines of thickness 2, in whole numbers: what OpenCV's `polylines` painted up to 4.12.

Each segment is a strip two cells wide, whose corners have 16 binary places, with its outline, and a plus of
five cells at each end (docs/definitions.md has the rule).
"""

from itertools import pairwise

import numpy as np

from ogmkit.labels.outline import clip
from ogmkit.typing import FloatArray, IntArray, UInt8Array

_BITS = 16
_ONE = 1 << _BITS
_HALF = _ONE >> 1
_PLUS = np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]])


def stroke_two(canvas: UInt8Array, points: IntArray) -> None:
    """Paint an open line of thickness 2 with ones.

    Args:
        canvas: (rows, columns), painted in place.
        points: (K, 2) int64 (column, row); they may lie outside.
    """
    for start, end in pairwise(points):
        if (start != end).any():
            strip = _strip(start.astype(np.float64), end.astype(np.float64))
            _paint_border(canvas, strip)
            _paint_strip(canvas, strip)
    rows, columns = (points[:, None, axis] + _PLUS[:, axis] for axis in (1, 0))
    inside = (rows >= 0) & (rows < canvas.shape[0]) & (columns >= 0) & (columns < canvas.shape[1])
    canvas[rows[inside], columns[inside]] = 1


def _strip(start: FloatArray, end: FloatArray) -> IntArray:
    """(4, 2) fixed-point corners: a cell to either side of the segment."""
    dx, dy = start[0] - end[0], end[1] - start[1]
    scale = _ONE / np.sqrt(dx * dx + dy * dy)
    aside = np.round(np.array([dy, dx]) * scale).astype(np.int64)
    a, b = (start * _ONE).astype(np.int64), (end * _ONE).astype(np.int64)
    return np.array([a + aside, a - aside, b - aside, b + aside])


def _paint_border(canvas: UInt8Array, strip: IntArray) -> None:
    """The strip's four edges, as fixed-point lines."""
    rows, columns = canvas.shape
    starts, ends = np.roll(strip, 1, axis=0), strip
    (x1, y1, x2, y2), _ = clip(starts, ends, (columns * _ONE - 1, rows * _ONE - 1))
    for edge in zip(x1.tolist(), y1.tolist(), x2.tolist(), y2.tolist(), strict=True):
        _paint_edge(canvas, *edge)


def _paint_edge(canvas: UInt8Array, x1: int, y1: int, x2: int, y2: int) -> None:
    across = abs(x2 - x1) > abs(y2 - y1)
    if (x2 < x1) if across else (y2 < y1):
        x1, y1, x2, y2 = x2, y2, x1, y1
    dx, dy = x2 - x1, y2 - y1
    step = int(dy * _ONE / (dx | 1)) if across else int(dx * _ONE / (dy | 1))
    major, minor = (x1, y1) if across else (y1, x1)
    count = ((x2 - x1) if across else (y2 - y1)) >> _BITS
    along = ((major + _HALF) >> _BITS) + np.arange(count + 1)
    aside = (minor + _HALF + step * np.arange(count + 1)) >> _BITS
    last = (x2 + _HALF) >> _BITS, (y2 + _HALF) >> _BITS
    columns, row = (along, aside) if across else (aside, along)
    _set(canvas, np.append(columns, last[0]), np.append(row, last[1]))


def _set(canvas: UInt8Array, columns: IntArray, rows: IntArray) -> None:
    inside = (columns >= 0) & (columns < canvas.shape[1]) & (rows >= 0) & (rows < canvas.shape[0])
    canvas[rows[inside], columns[inside]] = 1


def _paint_strip(canvas: UInt8Array, strip: IntArray) -> None:
    """What lies between the two chains of edges that lead down from the highest corner, above the lowest."""
    levels = (strip[:, 1] + _HALF) >> _BITS
    top = int(np.argmin(strip[:, 1]))
    rows = np.arange(levels.min(), min(levels.max(), canvas.shape[0]))
    sides = np.array([_chain(strip, levels, top, step, rows) for step in (1, -1)])
    left, right = (sides.min(axis=0) + _HALF) >> _BITS, (sides.max(axis=0) + _HALF) >> _BITS
    for row, start, stop in zip(rows.tolist(), left.tolist(), right.tolist(), strict=True):
        if row >= 0 and stop >= 0:
            canvas[row, max(start, 0) : stop + 1] = 1


def _chain(strip: IntArray, levels: IntArray, top: int, step: int, rows: IntArray) -> IntArray:
    """Fixed-point column of one chain at each row; an edge begins on the row that its end is rounded to."""
    columns = np.full(len(rows), -_ONE, dtype=np.int64)
    here, row = top, int(rows[0]) if len(rows) else 0
    for _ in range(len(strip)):
        following = (here + step) % len(strip)
        level = int(levels[following])
        if level > row:
            height = level - row
            slope = int(((strip[following, 0] - strip[here, 0]) * 2 + height) / (2 * height))
            later = rows >= row
            columns[later] = strip[here, 0] + (rows[later] - row) * slope
            row = level
        here = following
    return columns
