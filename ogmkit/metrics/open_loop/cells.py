"""Collisions by the field's rule: the ego's cells, never turned, on obstacles painted with their outline."""

from collections.abc import Sequence

import numpy as np

from ogmkit.labels.fill import paint_outlined, rounded
from ogmkit.metrics.open_loop.definition import EgoBox, Lattice
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array

CELLS = 200
"""Rows, and columns."""
M_PER_CELL = 0.5
_HALF_M = CELLS * M_PER_CELL / 2


def collisions(
    points: FloatArray, faces: Sequence[FloatArray | None], box: EgoBox, lattice: Lattice
) -> FloatArray:
    """Whether the ego collides.

    Args:
        points: (R, T, 2) metres from the present ego; NaN where a plan has none.
        faces: T arrays of (M, 4, 2) corners of obstacles' ground faces at that step, metres in the level
            frame of the present ego; None where they aren't known.
        box: the ego's.
        lattice: whose cells.

    Returns:
        (2, R, T) by the ego's box, and by the planned point alone: 1 where it collides, else 0; NaN where a
        plan has no point or obstacles aren't known.
    """
    found = np.full((2, *points.shape[:-1]), np.nan)
    for step, others in enumerate(faces):
        there = ~np.isnan(points[:, step, 0])
        if others is None or not there.any():
            continue
        painted, own = paint(others, lattice), points[there, step]
        found[0, there, step] = _any_set(painted, box_cells(own, box, lattice))
        found[1, there, step] = _any_set(painted, point_cells(own, lattice))
    return found


def paint(faces: FloatArray, lattice: Lattice) -> UInt8Array:
    """(200, 200) uint8, 1 on obstacles and on their outlines.

    Args:
        faces: (M, 4, 2) corners, metres, level frame.
        lattice: whose cells.
    """
    row, column = _along(faces - (lattice.origin_ahead_m, 0.0), lattice)
    canvas = np.zeros((CELLS, CELLS), np.uint8)
    rings = rounded(np.stack([column, row], axis=-1) / M_PER_CELL + _HALF_M / M_PER_CELL)
    paint_outlined(canvas, [*rings], range(len(rings)), [1] * len(rings))
    return canvas


def box_cells(points: FloatArray, box: EgoBox, lattice: Lattice) -> IntArray:
    """(..., C, 2) row and column of the ego's cells at (..., 2) metres, moved to the border if beyond it."""
    row, column = _along(points, lattice)
    along = _indices(box.centre_ahead_m, box.length_m)
    if lattice.rows_from == "front":
        along = CELLS - along
    across = _indices(0.0, box.width_m)
    grid = np.stack(np.meshgrid(along, across, indexing="ij"), axis=-1).reshape(-1, 2)
    moved = np.stack([row, column], axis=-1)[..., None, :] / M_PER_CELL + grid
    return np.clip(np.trunc(moved), 0, CELLS - 1).astype(np.int64)


def point_cells(points: FloatArray, lattice: Lattice) -> IntArray:
    """(..., 1, 2) row and column of the cell that a planned point at (..., 2) metres is looked up in.

    It may lie outside the array.
    """
    row, column = _along(points, lattice)
    index = np.trunc((np.stack([row, column], axis=-1) + lattice.point_from_m) / M_PER_CELL)
    found: IntArray = index.astype(np.int64)[..., None, :]
    return found


def _along(points: FloatArray, lattice: Lattice) -> tuple[FloatArray, FloatArray]:
    """Metres along rows and along columns."""
    row = points[..., 0] if lattice.rows_from == "rear" else -points[..., 0]
    return row, points[..., 1] if lattice.columns_to == "left" else -points[..., 1]


def _indices(centre_m: float, length_m: float) -> FloatArray:
    """Whole indices in an interval, of cells whose centres are at −49.75, −49.25 … m."""
    first, last = ((centre_m + half + _HALF_M) / M_PER_CELL - 0.5 for half in (-length_m / 2, length_m / 2))
    return np.arange(np.ceil(first), np.floor(last) + 1)


def _any_set(painted: UInt8Array, cells: IntArray) -> BoolArray:
    """(...) whether any of (..., C, 2) cells is painted; those outside are not."""
    inside: BoolArray = np.logical_and.reduce((cells >= 0) & (cells < CELLS), axis=-1)
    row, column = np.moveaxis(np.where(inside[..., None], cells, 0), -1, 0)
    result: BoolArray = (inside & (painted[row, column] > 0)).any(axis=-1)
    return result
