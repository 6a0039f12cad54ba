"""The cells that a camera sees, by its calibration and a flat ground (design.md §5)."""

import numpy as np

from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec
from ogmkit.raster.fill import fill_spans
from ogmkit.typing import FloatArray, UInt8Array


def field_of_view_mask(
    grid: GridSpec, intrinsics: FloatArray, level_from_camera: FloatArray, image_size: tuple[int, int]
) -> UInt8Array:
    """Mark the cells whose centre, on the plane z = 0 of the level frame, projects into the image.

    The image reaches half a pixel beyond the outer pixels' centres. Each of its four borders is a half-plane
    of the ground, with a depth w that need not be divided by: left of the right border, for one, means
    u·w < (width − 0.5)·w. The four together imply w > 0, since the camera is not on the ground.

    Args:
        grid: the grid.
        intrinsics: (3, 3).
        level_from_camera: (4, 4).
        image_size: (height, width) in pixels.

    Returns:
        (rows, columns) uint8, 1 where the camera sees the ground.
    """
    u, v, depth = image_from_ground(intrinsics, level_from_camera) @ grid.level_from_bev
    height, width = image_size
    inside = np.array([u + depth / 2, (width - 0.5) * depth - u, v + depth / 2, (height - 0.5) * depth - v])
    rows = np.arange(grid.rows)
    slope = inside[:, :1]
    offset = inside[:, 1:2] * rows + inside[:, 2:]  # (4, rows): the border's value at column 0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        border = -offset / slope
    first = np.where(slope > 0, border, -np.inf).max(axis=0)
    last = np.where(slope < 0, border, np.inf).min(axis=0)
    # A border along the rows has no slope: it lets a whole row through or none.
    open_row = ((slope != 0) | (offset >= 0)).all(axis=0) & (first < last)
    return fill_spans(rows[open_row], first[open_row], last[open_row], grid.shape)
