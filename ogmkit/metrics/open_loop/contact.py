"""Exactly: whether the ego's turned box touches another's, or leaves the drivable area."""

from collections.abc import Sequence

import numpy as np
import shapely

from ogmkit.grid import GridSpec
from ogmkit.metrics.open_loop.body import corners, outline, placed
from ogmkit.metrics.open_loop.definition import EgoBox
from ogmkit.typing import BoolArray, FloatArray, UInt8Array


def contacts(
    points: FloatArray,
    faces: Sequence[FloatArray | None],
    box: EgoBox,
    known: FloatArray | None = None,
) -> FloatArray:
    """Whether the ego's box touches an obstacle's.

    Args:
        points: (R, T, 2) metres; NaN where a plan has none.
        faces: T arrays of (M, 4, 2) corners in order round each obstacle's ground face at that step, metres
            in the plans' frame; None where they aren't known.
        box: the ego's.
        known: (R, T) headings, as of `placed`.

    Returns:
        (R, T) 1 where it touches one, else 0; NaN where a plan has no point or obstacles aren't known.
    """
    bodies = placed(points, box, corners(box), known)
    found = np.full(points.shape[:-1], np.nan)
    for step, others in enumerate(faces):
        there = ~np.isnan(points[:, step, 0])
        if others is None or not there.any():
            continue
        own = shapely.polygons(bodies[there, step])
        found[there, step] = shapely.intersects(own[:, None], shapely.polygons(others)).any(axis=1)
    return found


def edge_crossings(
    points: FloatArray,
    drivable: UInt8Array,
    grid: GridSpec,
    box: EgoBox,
    known: FloatArray | None = None,
) -> FloatArray:
    """Whether the outline of the ego's box lies on cells that aren't drivable.

    Args:
        points: (..., 2) metres, level frame; the last axis but one is a plan's points.
        drivable: (rows, columns) uint8 0/1.
        grid: its grid.
        box: the ego's.
        known: (...) headings, as of `placed`.

    Returns:
        (...) 1 where it does, 0 where not; parts outside the grid don't count, NaN where all are.
    """
    line = placed(points, box, outline(box, grid.m_per_cell), known)
    there: BoolArray = np.logical_and.reduce(~np.isnan(line), axis=-1)
    cells = np.floor(grid.cells(np.where(there[..., None], line, 0.0)) + 0.5).astype(np.int64)
    column, row = np.moveaxis(cells, -1, 0)
    inside = there & (row >= 0) & (row < grid.rows) & (column >= 0) & (column < grid.columns)
    off = inside & (drivable[np.where(inside, row, 0), np.where(inside, column, 0)] == 0)
    return np.where(inside.any(axis=-1), off.any(axis=-1), np.nan)
