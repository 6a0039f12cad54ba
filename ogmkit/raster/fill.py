"""Polygon fill by cell centres: an exact scanline; drawing routines also paint the outline (design.md §1)."""

from collections.abc import Sequence

import numpy as np

from ogmkit.raster.ranges import ranges
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array, UInt16Array

_SHORT = 64
"""Cells of a span up to which a table of them all is quicker than a slice for each."""


def fill_polygons(
    rings: Sequence[FloatArray] | FloatArray,
    shape: tuple[int, int],
    *,
    polygon_of_ring: Sequence[int] | None = None,
) -> UInt8Array:
    """Mark the cells whose centre lies inside a polygon.

    Inside is even-odd among the rings of one polygon (so an inner ring is a hole) and a union over polygons.
    Ties are half-open: a centre on a left or upper border is inside, one on a right or lower border is not,
    so polygons that share a border neither overlap nor leave a gap. (Foley et al., Computer Graphics, 3.6.)

    Args:
        rings: closed outlines, each (K, 2) finite float64 (column, row) in cells, the end joined to the
            start; any orientation, need not be convex nor lie in the grid.
        shape: (rows, columns).
        polygon_of_ring: the polygon that each ring belongs to; every ring is one of its own by default.

    Returns:
        (rows, columns) uint8, 1 inside.
    """
    lengths = np.array([len(ring) for ring in rings], dtype=np.int64)
    if not lengths.any():
        return np.zeros(shape, np.uint8)
    owners = np.arange(len(lengths)) if polygon_of_ring is None else np.asarray(polygon_of_ring)
    _, rows, first, last = _spans(np.concatenate(rings), lengths, owners, shape[0])
    return fill_spans(rows, first, last, shape)


def number_polygons(rings: FloatArray, numbers: IntArray, shape: tuple[int, int]) -> UInt16Array:
    """Write the number of a polygon into the cells whose centre lies inside; of several, the last one's.

    Args:
        rings: (M, K, 2) outlines, as of `fill_polygons`.
        numbers: (M,) 1 to 65535.
        shape: (rows, columns).

    Returns:
        (rows, columns) uint16, 0 where there is no polygon.
    """
    numbered = np.zeros(shape, np.uint16)
    lengths = np.full(len(rings), rings.shape[1], dtype=np.int64)
    polygons, rows, first, last = _spans(rings.reshape(-1, 2), lengths, np.arange(len(rings)), shape[0])
    cells = numbered.reshape(-1)
    starts, stops, kept = _bounds(rows, first, last, shape)
    columns = (starts, stops, numbers[polygons[kept]])
    for start, stop, number in zip(*(one.tolist() for one in columns), strict=True):
        cells[start:stop] = number
    return numbered


def fill_spans(rows: IntArray, first: FloatArray, last: FloatArray, shape: tuple[int, int]) -> UInt8Array:
    """Mark the cells whose centre lies in a horizontal span; spans may overlap.

    Args:
        rows: (S,) row of each span, inside the grid.
        first: (S,) column where each begins; a centre exactly there is inside.
        last: (S,) column where each ends; a centre exactly there is outside.
        shape: (rows, columns).

    Returns:
        (rows, columns) uint8, 1 inside.
    """
    starts, stops, _ = _bounds(rows, first, last, shape)
    mask = np.zeros(shape, np.uint8)
    cells = mask.reshape(-1)
    lengths = stops - starts
    if lengths.sum() < _SHORT * len(lengths):
        cells[ranges(starts, lengths)] = 1
        return mask
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        cells[start:stop] = 1
    return mask


def _bounds(
    rows: IntArray, first: FloatArray, last: FloatArray, shape: tuple[int, int]
) -> tuple[IntArray, IntArray, IntArray]:
    """Where spans begin and end among all cells, row by row, and which they are: those that have cells."""
    begin, end = np.ceil(np.clip([first, last], 0, shape[1])).astype(np.int64)
    kept = np.flatnonzero(begin < end)
    before = rows[kept] * shape[1]
    return before + begin[kept], before + end[kept], kept


def _spans(
    vertices: FloatArray, lengths: IntArray, polygon_of_ring: IntArray, rows: int
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Polygon, row, first and last column of each span inside, in the polygons' order."""
    upper, lower, _ = edges(vertices, lengths)
    polygon, row, column = crossings(upper, lower, np.repeat(polygon_of_ring, lengths), rows)
    # A closed ring crosses each scanline an even number of times: sorted, neighbours pair into spans.
    order = np.lexsort((column, row, polygon))
    polygon, row, column = polygon[order], row[order], column[order]
    return polygon[::2], row[::2], column[::2], column[1::2]


def edges(vertices: FloatArray, lengths: IntArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Upper and lower end of every edge, (E, 2) each, so that an edge shared by two polygons is cut alike.

    And (E,) whether it runs down.
    """
    successor = np.arange(1, len(vertices) + 1)
    stops = np.cumsum(lengths)[lengths > 0]
    successor[stops - 1] = stops - lengths[lengths > 0]
    following = vertices[successor]
    downward = vertices[:, 1] <= following[:, 1]
    down = downward[:, None]
    return np.where(down, vertices, following), np.where(down, following, vertices), downward


def crossings(
    upper: FloatArray, lower: FloatArray, of_edge: IntArray, rows: int
) -> tuple[IntArray, IntArray, FloatArray]:
    """Places where edges cross a row of cell centres: what is said of the edge, row and column (float)."""
    first = np.ceil(np.clip(upper[:, 1], 0, rows)).astype(np.int64)
    stop = np.ceil(np.clip(lower[:, 1], 0, rows)).astype(np.int64)
    count = stop - first
    edge = np.repeat(np.arange(len(count)), count)
    row = ranges(first, count)
    x_top, top = upper.T[:, edge]
    x_bottom, bottom = lower.T[:, edge]
    share = (row - top) / (bottom - top)
    return of_edge[edge], row, x_top + share * (x_bottom - x_top)
