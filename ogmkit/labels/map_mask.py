"""The drivable area of a map mask in a definition's array."""

from ogmkit.frames import KeyFrame
from ogmkit.geometry.se3 import level_from_global
from ogmkit.grid import GridSpec
from ogmkit.labels.definition import Definition, Grid
from ogmkit.nuscenes.maps import MapMask
from ogmkit.raster.drivable import drivable_mask
from ogmkit.typing import UInt8Array


def paint_mask(key_frame: KeyFrame, definition: Definition, map_mask: MapMask) -> UInt8Array:
    """(rows, columns) uint8: whether cells' centres are drivable, in the level frame of the sweep."""
    return drivable_mask(grid_spec(definition.grid), level_from_global(key_frame.global_from_ego), map_mask)


def grid_spec(grid: Grid) -> GridSpec:
    """The grid of an array whose rows lead back and columns to the right, as the paper's do."""
    m_per_cell = -grid.rows.step_m
    ego_row, ego_column = (axis.first_m / m_per_cell + 0.5 for axis in (grid.rows, grid.columns))
    return GridSpec(m_per_cell, *grid.shape, ego_row, ego_column)
