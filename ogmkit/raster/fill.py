"""Polygon fill by cell centres: an exact scanline; drawing routines also paint the outline (design.md §1)."""

from collections.abc import Sequence

import numpy as np

from ogmkit.typing import FloatArray, IntArray, UInt8Array


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
    polygon_of_edge = np.repeat(
        np.arange(len(lengths)) if polygon_of_ring is None else polygon_of_ring, lengths
    )
    polygons, rows, columns = _crossings(*_edges(np.concatenate(rings), lengths), polygon_of_edge, shape[0])
    # A closed ring crosses each scanline an even number of times: sorted, neighbours pair into spans.
    order = np.lexsort((columns, rows, polygons))
    rows, columns = rows[order], columns[order]
    return fill_spans(rows[::2], columns[::2], columns[1::2], shape)


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
    mask = np.zeros(shape, np.uint8)
    starts = rows * shape[1] + np.ceil(np.clip(first, 0, shape[1])).astype(np.int64)
    stops = rows * shape[1] + np.ceil(np.clip(last, 0, shape[1])).astype(np.int64)
    cells = mask.reshape(-1)
    # A frame has some thousand short spans: slices beat a table of all their cells, and need no memory.
    for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
        cells[start:stop] = 1
    return mask


def _edges(vertices: FloatArray, lengths: IntArray) -> tuple[FloatArray, FloatArray]:
    """Upper and lower end of every edge, (E, 2) each, so that an edge shared by two polygons is cut alike."""
    successor = np.arange(1, len(vertices) + 1)
    stops = np.cumsum(lengths)[lengths > 0]
    successor[stops - 1] = stops - lengths[lengths > 0]
    following = vertices[successor]
    downward = (vertices[:, 1] <= following[:, 1])[:, None]
    return np.where(downward, vertices, following), np.where(downward, following, vertices)


def _crossings(
    upper: FloatArray, lower: FloatArray, polygon_of_edge: IntArray, rows: int
) -> tuple[IntArray, IntArray, FloatArray]:
    """Polygon, row and column (float) of each place where an edge crosses a row of cell centres."""
    first = np.ceil(np.clip(upper[:, 1], 0, rows)).astype(np.int64)
    stop = np.ceil(np.clip(lower[:, 1], 0, rows)).astype(np.int64)
    count = stop - first
    edge = np.repeat(np.arange(len(count)), count)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count - first, count)
    top, bottom = upper[edge], lower[edge]
    share = (row - top[:, 1]) / (bottom[:, 1] - top[:, 1])
    return polygon_of_edge[edge], row, top[:, 0] + share * (bottom[:, 0] - top[:, 0])
