"""Polygons in whole numbers: inside by even-odd scanlines, and the outline always (docs/definitions.md).

`cv2.fillPoly` of 4.8 to 4.10, and from 4.11 on, draws other cells; `cv2.fillConvexPoly` has not changed.
"""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ogmkit.labels.outline import line_cells, truncated
from ogmkit.raster.ranges import ranges
from ogmkit.typing import FloatArray, IntArray

_ONE = 1 << 16
"""A cell in the fixed-point columns of scanlines."""


def paint_outlined(
    canvas: NDArray[Any],
    rings: Sequence[IntArray],
    polygon_of_ring: Sequence[int],
    values: Sequence[int],
) -> None:
    """Paint polygons one over the other: all cells inside, and those that the outline touches.

    Args:
        canvas: (rows, columns), painted in place.
        rings: closed outlines, each (K, 2) int64 (column, row), the end joined to the start; they may leave
            the canvas.
        polygon_of_ring: the polygon that each ring belongs to, rising; inside is even-odd among its rings.
        values: of each polygon; later ones cover earlier ones.
    """
    if not rings:
        return
    lengths = np.array([len(ring) for ring in rings], dtype=np.int64)
    ends = np.concatenate(rings)
    starts = ends[_predecessors(lengths)]
    owner = np.repeat(np.asarray(polygon_of_ring, dtype=np.int64), lengths)
    lines, outline = line_cells(starts, ends, canvas.shape)
    owners, inside = _inside(starts, ends, owner, canvas.shape)
    painter = np.concatenate([owner[lines], owners])
    order = np.argsort(painter, kind="stable")
    # Of cells that are assigned several times, the last value stays.
    canvas.reshape(-1)[np.concatenate([outline, inside])[order]] = np.asarray(values)[painter[order]]


def paint_convex(canvas: NDArray[Any], rings: Sequence[IntArray], values: Sequence[int]) -> None:
    """Paint rings one over the other by the rule for convex polygons, which also those get that are not."""
    for ring, value in zip(rings, values, strict=True):
        cv2.fillConvexPoly(canvas, ring.astype(np.int32), int(value))


def rounded(points: FloatArray) -> IntArray:
    """Nearest whole numbers, half to even."""
    result: IntArray = np.round(points).astype(np.int64)
    return result


def _predecessors(lengths: IntArray) -> IntArray:
    """For each vertex of rings that stand one after the other, the row of the one before it in its ring."""
    before = np.arange(-1, int(lengths.sum()) - 1)
    stops = np.cumsum(lengths)
    filled = lengths > 0
    before[(stops - lengths)[filled]] = stops[filled] - 1
    return before


def _inside(
    starts: IntArray, ends: IntArray, owner: IntArray, shape: tuple[int, int]
) -> tuple[IntArray, IntArray]:
    """Polygon and cell of everything between paired crossings."""
    owners, rows, columns = _crossings(starts, ends, owner, shape[0])
    order = np.lexsort((columns, rows, owners))
    owners, rows, columns = (values[order] for values in (owners, rows, columns))
    first = np.maximum(-(-columns[::2] // _ONE), 0)
    stop = np.minimum(columns[1::2] // _ONE, shape[1] - 1) + 1
    count = np.maximum(stop - first, 0)
    span = np.repeat(np.arange(len(count)), count)
    return owners[::2][span], rows[::2][span] * shape[1] + ranges(first, count)


def _crossings(
    starts: IntArray, ends: IntArray, owner: IntArray, rows: int
) -> tuple[IntArray, IntArray, IntArray]:
    """Polygon, row and fixed-point column of each place where an edge crosses a row's middle."""
    falling = (starts[:, 1] > ends[:, 1])[:, None]
    top, bottom = np.where(falling, ends, starts), np.where(falling, starts, ends)
    height = bottom[:, 1] - top[:, 1]
    slope = truncated((bottom[:, 0] - top[:, 0]) * float(_ONE), np.maximum(height, 1))
    first, stop = np.clip(top[:, 1], 0, rows), np.clip(bottom[:, 1], 0, rows)
    count = stop - first
    edge = np.repeat(np.arange(len(count)), count)
    row = ranges(first, count)
    column = top[edge, 0] * _ONE + (row - top[edge, 1]) * slope[edge]
    return owner[edge], row, column
