"""Fill of very many polygons at once, by how often rings wind round a cell's centre (design.md §1)."""

import numpy as np

from ogmkit.raster.fill import crossings, edges
from ogmkit.typing import FloatArray, IntArray, UInt8Array


def fill_wound(
    vertices: FloatArray, lengths: IntArray, turns: IntArray, planes: IntArray, shape: tuple[int, int, int]
) -> UInt8Array:
    """Mark the cells round which rings wind, in several rasters; polygons of one raster unite.

    A polygon's outline must not cross itself: where outer rings wind one way and their holes the other, a
    cell is inside if rings wind round it in sum. That takes one sort of all crossings, whatever polygon they
    are of. Ties are as of `fill_polygons`.

    Args:
        vertices: (V, 2) finite float64 (column, row) of closed rings, one after the other.
        lengths: (R,) vertices of each ring.
        turns: (R,) +1 for a ring that runs down along the left of what is inside, else −1.
        planes: (R,) the raster that each ring belongs to.
        shape: (rasters, rows, columns).

    Returns:
        (rasters, rows, columns) uint8, 1 inside.
    """
    upper, lower, downward = edges(vertices, lengths)
    turn = np.where(downward, 1, -1) * np.repeat(turns, lengths)
    plane = np.repeat(planes, lengths)
    # Most edges cross no row within the grid's columns: of those before, only their sum in a row counts.
    before = (upper[:, 0] < 0) & (lower[:, 0] < 0)
    among = ~before & ((upper[:, 0] < shape[2]) | (lower[:, 0] < shape[2]))
    opened = _sums(upper[before], lower[before], turn[before], plane[before], shape)
    edge, row, column = crossings(upper[among], lower[among], np.flatnonzero(among), shape[1])
    row, turn = plane[edge] * shape[1] + row, turn[edge]
    left_open = opened + np.bincount(row, turn, minlength=len(opened)).astype(np.int64)
    places = row * shape[2] + np.ceil(np.clip(column, 0, shape[2])).astype(np.int64)
    starts, ends = np.arange(len(opened)) * shape[2], np.arange(1, len(opened) + 1) * shape[2]
    return _filled(np.concatenate([places, starts, ends]), np.concatenate([turn, opened, -left_open]), shape)


def _sums(
    upper: FloatArray, lower: FloatArray, turn: IntArray, plane: IntArray, shape: tuple[int, int, int]
) -> IntArray:
    """(rasters · rows,) by how much all these edges together change the winding number of a row."""
    size = shape[0], shape[1] + 1
    first, stop = (
        plane * size[1] + np.ceil(np.clip(ends[:, 1], 0, shape[1])).astype(np.int64)
        for ends in (upper, lower)
    )
    changes = np.bincount(first, turn, minlength=size[0] * size[1]) - np.bincount(
        stop, turn, minlength=size[0] * size[1]
    )
    return np.cumsum(changes.reshape(size), axis=1)[:, :-1].reshape(-1).astype(np.int64)


def _filled(places: IntArray, changes: IntArray, shape: tuple[int, int, int]) -> UInt8Array:
    """The rasters whose cells, one after the other, are 1 from where changes sum to more than 0."""
    order = np.argsort(places)
    inside = np.concatenate([[False], np.cumsum(changes[order]) > 0])
    borders = places[order][inside[1:] != inside[:-1]]
    runs = np.diff(borders, prepend=0, append=shape[0] * shape[1] * shape[2])
    return np.repeat((np.arange(len(runs)) & 1).astype(np.uint8), runs).reshape(shape)
