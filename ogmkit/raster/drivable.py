"""The drivable raster: the map's mask seen through the grid (design.md §1)."""

import math

import cv2
import numpy as np

from ogmkit.geometry.se3 import inverse
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.maps import MapMask
from ogmkit.typing import FloatArray, UInt8Array

_PX_PER_M = 10.0
_MAX_WINDOW_PX = 4096


def drivable_mask(grid: GridSpec, level_from_global: FloatArray, map_mask: MapMask) -> UInt8Array:
    """Mark the cells whose centre is on the map's drivable area.

    The mask pixel of a centre is (x / 0.1, height − y / 0.1), rounded to the nearest integers: the devkit's
    `MapMask.to_pixel_coords`. Outside the mask nothing is drivable.

    Args:
        grid: the grid.
        level_from_global: (4, 4).
        map_mask: the map's mask, 0.1 m a pixel.

    Returns:
        (rows, columns) uint8, 1 = drivable.
    """
    pixel_from_bev = _pixel_from_level(level_from_global, map_mask) @ grid.level_from_bev
    result = np.zeros(grid.shape, np.uint8)
    # The warp takes sources below 2^15 pixels a side, and coarse grids span kilometres: tile by tile.
    px_per_cell = _PX_PER_M * grid.m_per_cell
    step = max(1, int(_MAX_WINDOW_PX / (math.sqrt(2) * px_per_cell)))
    for row in range(0, grid.rows, step):
        for column in range(0, grid.columns, step):
            tile = result[row : row + step, column : column + step]
            pixel_from_tile = pixel_from_bev @ np.array([[1.0, 0, column], [0, 1, row], [0, 0, 1]])
            _sample(tile, pixel_from_tile, map_mask)
    return result


def _pixel_from_level(level_from_global: FloatArray, map_mask: MapMask) -> FloatArray:
    """(3, 3) affine map from (x, y, 1) of the level frame to (column, row, 1) of the mask."""
    global_from_level = inverse(level_from_global)[np.ix_([0, 1, 3], [0, 1, 3])]
    pixel_from_global = np.array([[_PX_PER_M, 0, 0], [0, -_PX_PER_M, map_mask.shape[0]], [0, 0, 1]])
    result: FloatArray = pixel_from_global @ global_from_level
    return result


def _sample(tile: UInt8Array, pixel_from_tile: FloatArray, map_mask: MapMask) -> None:
    """Fill a tile of the raster with the mask's nearest pixels."""
    rows, columns = tile.shape
    corners = np.array([[0, columns - 1, 0, columns - 1], [0, 0, rows - 1, rows - 1], [1, 1, 1, 1]])
    pixels = (pixel_from_tile @ corners)[:2]
    limits = np.array([[map_mask.shape[1]], [map_mask.shape[0]]])
    # One pixel more on each side: rounding may step outside the corners' box.
    low, high = np.clip(
        np.stack([np.floor(pixels.min(axis=1)) - 1, np.ceil(pixels.max(axis=1)) + 2]), 0, limits.T
    ).astype(int)
    if (low >= high).any():
        return
    window = map_mask.window(low[1], high[1], low[0], high[0])
    window_from_tile = pixel_from_tile[:2] - [[0, 0, low[0]], [0, 0, low[1]]]
    # Straight into the raster: allocating and copying a result would double the time.
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    cv2.warpAffine(window, window_from_tile, (columns, rows), dst=tile, flags=flags)
