"""A system's own BEV grid: the shard's, coarsened by a whole factor."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.typing import UInt8Array

_WHOLE = 1e-6
"""How far the quotient of two cell sizes may be from a whole number, as a share of it."""

_Value = TypeVar("_Value", bound=np.generic)


def coarse_grid(grid: GridSpec, cell_m: float) -> tuple[GridSpec, int]:
    """The grid of the same extent with larger cells.

    Args:
        grid: the shard's.
        cell_m: side of a cell of the own grid, metres.

    Returns:
        The own grid, and how many fine cells make one of its cells' sides.

    Raises:
        SettingsError: the cell is not a whole number of the grid's, or rows or columns don't divide by it.
    """
    quotient = cell_m / grid.m_per_cell
    factor = round(quotient) if np.isfinite(quotient) else 0
    if factor < 1 or abs(quotient - factor) > _WHOLE * factor:
        raise SettingsError(
            f"BEV cell: {cell_m:g} m is not a whole number of the shards' cells of {grid.m_per_cell:g} m"
        )
    if grid.rows % factor or grid.columns % factor:
        raise SettingsError(
            f"BEV cell: {cell_m:g} m, {factor} cells of the shards, does not divide their grid of "
            f"{grid.rows} rows × {grid.columns} columns"
        )
    own = GridSpec(
        m_per_cell=grid.m_per_cell * factor,
        rows=grid.rows // factor,
        columns=grid.columns // factor,
        ego_row=grid.ego_row / factor,
        ego_column=grid.ego_column / factor,
    )
    return own, factor


def majority(masks: UInt8Array, factor: int) -> UInt8Array:
    """Coarsen masks: a cell is 1 where at least half of its fine cells are.

    Args:
        masks: (..., rows, columns) uint8 0/1; the factor divides rows and columns.
        factor: fine cells along a coarse cell's side.

    Returns:
        (..., rows / factor, columns / factor) uint8 0/1.
    """
    if factor == 1:
        return masks
    *leading, rows, columns = masks.shape
    cells = factor * factor
    # Whole rows first, and both sums in the smallest type that holds them: several times faster.
    by_rows = masks.reshape(*leading, rows // factor, factor, columns)
    strips = by_rows.sum(axis=-2, dtype=np.min_scalar_type(factor))
    filled = np.zeros((*leading, rows // factor, columns // factor), np.min_scalar_type(cells))
    for column in range(factor):
        filled += strips[..., column::factor]
    return np.asarray(filled >= (cells + 1) // 2, dtype=np.uint8)


def repeat_cells(cells: NDArray[_Value], factor: int) -> NDArray[_Value]:
    """Give each of (..., r, c) cells to all its fine cells: (..., r · factor, c · factor)."""
    return cells.repeat(factor, axis=-2).repeat(factor, axis=-1)
