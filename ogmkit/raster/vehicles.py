"""The vehicle canvas: ground faces of annotated boxes (design.md §3)."""

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.grid import GridSpec
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array


def select(
    boxes: Boxes,
    categories: tuple[str, ...] = ("vehicle.",),
    min_visibility: int = 0,
    min_lidar_points: int = 0,
) -> Boxes:
    """The boxes that the canvas shows.

    Args:
        boxes: all boxes of a frame.
        categories: beginnings of the category names wanted.
        min_visibility: lowest visibility level wanted, 0 to 4; boxes of unknown visibility always stay.
        min_lidar_points: fewest LiDAR points wanted; boxes with an unknown number always stay.
    """
    wanted = np.array([name.startswith(categories) for name in boxes.category], dtype=np.bool_)
    seen = observed(boxes.visibility, boxes.num_lidar_pts, min_visibility, min_lidar_points)
    return boxes.selected(wanted & seen)


def observed(
    visibility: UInt8Array, num_lidar_pts: IntArray, min_visibility: int, min_lidar_points: int
) -> BoolArray:
    """(M,) boxes that were seen well enough; what is unknown passes.

    Args:
        visibility: (M,) uint8, 1 to 4; 0 = unknown.
        num_lidar_pts: (M,) int64; −1 = unknown.
        min_visibility: lowest level wanted.
        min_lidar_points: fewest points wanted.
    """
    clear = (visibility == 0) | (visibility >= min_visibility)
    seen: BoolArray = clear & ((num_lidar_pts < 0) | (num_lidar_pts >= min_lidar_points))
    return seen


def vehicle_mask(grid: GridSpec, level_from_global: FloatArray, boxes: Boxes) -> UInt8Array:
    """Mark the cells whose centre lies on the ground face of a box, seen from straight above.

    Args:
        grid: the grid.
        level_from_global: (4, 4).
        boxes: the boxes to draw; overlapping ones unite.

    Returns:
        (rows, columns) uint8, 1 on a box.
    """
    corners_level = ground_corners(level_from_global @ boxes.global_from_box, boxes.size_wlh)
    return fill_polygons(grid.cells(corners_level), grid.shape)
