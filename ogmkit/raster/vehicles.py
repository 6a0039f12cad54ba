"""The vehicle canvas: ground faces of annotated boxes (design.md §3)."""

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.grid import GridSpec
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import FloatArray, UInt8Array


def select(boxes: Boxes, categories: tuple[str, ...] = ("vehicle.",), min_visibility: int = 0) -> Boxes:
    """The boxes that the canvas shows.

    Args:
        boxes: all boxes of a frame.
        categories: beginnings of the category names wanted.
        min_visibility: lowest visibility level wanted, 0 to 4; boxes of unknown visibility always stay.
    """
    wanted = np.array([name.startswith(categories) for name in boxes.category], dtype=np.bool_)
    return boxes.selected(wanted & ((boxes.visibility == 0) | (boxes.visibility >= min_visibility)))


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
