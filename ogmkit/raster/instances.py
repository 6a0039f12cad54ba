"""Instances as cells: whose box a cell is under, where its centre is, where it goes (design.md §3)."""

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.grid import GridSpec
from ogmkit.raster.fill import number_polygons
from ogmkit.typing import Float32Array, FloatArray, IntArray, UInt16Array


def instance_raster(
    grid: GridSpec, level_from_global: FloatArray, boxes: Boxes, numbers: IntArray
) -> UInt16Array:
    """Write each box's number into the cells whose centre lies on its ground face, seen from above.

    Args:
        grid: the grid.
        level_from_global: (4, 4).
        boxes: the boxes to draw; of those over one cell, the last one counts.
        numbers: (M,) 1 to 65535.

    Returns:
        (rows, columns) uint16, 0 where there is no box.
    """
    corners_level = ground_corners(level_from_global @ boxes.global_from_box, boxes.size_wlh)
    return number_polygons(grid.cells(corners_level), numbers, grid.shape)


def centre_offset(
    grid: GridSpec, level_from_global: FloatArray, boxes: Boxes, numbers: IntArray, raster: UInt16Array
) -> Float32Array:
    """From each cell's centre to the centre of its box.

    Args:
        grid: the grid.
        level_from_global: (4, 4).
        boxes: M boxes.
        numbers: (M,) theirs.
        raster: (rows, columns) uint16 of `instance_raster`.

    Returns:
        (2, rows, columns) float32 x, y in metres, level frame; NaN without a box.
    """
    cells, box, points = _owned(grid, numbers, raster)
    centres, _ = _ground_faces(level_from_global, boxes)
    return _spread(grid, cells, centres[box] - points)


def rigid_flow(
    grid: GridSpec,
    level_from_global: FloatArray,
    boxes: Boxes,
    following: Boxes,
    numbers: IntArray,
    raster: UInt16Array,
) -> Float32Array:
    """How each cell's centre moves until the next frame if it moves rigidly with its box.

    The ego's own motion is not in it: what stands has no flow.

    Args:
        grid: the grid.
        level_from_global: (4, 4) of this frame.
        boxes: M boxes of this frame.
        following: all boxes of the next one, in any order.
        numbers: (M,) of this frame's boxes.
        raster: (rows, columns) uint16 of `instance_raster`.

    Returns:
        (2, rows, columns) float32 x, y in metres, level frame of this frame; NaN without a box, and where the
        next frame has not the box's instance.
    """
    cells, box, points = _owned(grid, numbers, raster)
    place = {token: row for row, token in enumerate(following.instance_token)}
    rows = np.array([place.get(token, -1) for token in boxes.instance_token], dtype=np.int64)
    goes_on = rows[box] >= 0
    cells, box, points = cells[goes_on], box[goes_on], points[goes_on]
    used, which = np.unique(box, return_inverse=True)
    centres, axes = _ground_faces(level_from_global, boxes, used)
    next_centres, next_axes = _ground_faces(level_from_global, following, rows[used])
    turns = (next_axes @ np.linalg.inv(axes))[which]
    from_centre = points - centres[which]
    moved = np.einsum("...ij,...j->...i", turns, from_centre) + next_centres[which]
    return _spread(grid, cells, moved - points)


def _owned(grid: GridSpec, numbers: IntArray, raster: UInt16Array) -> tuple[IntArray, IntArray, FloatArray]:
    """Cells that have a box: their places among all, their boxes, and (n, 2) their centres in metres."""
    cells = np.flatnonzero(raster)
    row, column = np.divmod(cells, grid.columns)
    points = grid.positions_m(np.column_stack([column, row]).astype(np.float64))
    order = np.argsort(numbers)
    box = order[np.searchsorted(numbers[order], raster.reshape(-1)[cells])]
    return cells, box, points


def _ground_faces(
    level_from_global: FloatArray, boxes: Boxes, rows: IntArray | slice = slice(None)
) -> tuple[FloatArray, FloatArray]:
    """(n, 2) centres of ground faces seen from above, metres, and (n, 2, 2) their axes as columns."""
    level_from_box = level_from_global @ boxes.global_from_box[rows]
    down = level_from_box[:, :2, 2] * boxes.size_wlh[rows][:, 2:] / 2
    return level_from_box[:, :2, 3] - down, level_from_box[:, :2, :2]


def _spread(grid: GridSpec, cells: IntArray, values: FloatArray) -> Float32Array:
    """(2, rows, columns) float32 of (n, 2) values at some cells, NaN elsewhere."""
    result = np.full((2, grid.rows * grid.columns), np.nan, np.float32)
    result[:, cells] = values.T
    return result.reshape(2, *grid.shape)
