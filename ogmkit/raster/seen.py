"""Which cells of a camera's grid are seen, by more than its field of view."""

from collections.abc import Collection

import numpy as np

from ogmkit.frames import FrameRecord
from ogmkit.grid import GridSpec
from ogmkit.raster.occlusion import reached_mask, unhidden_mask
from ogmkit.typing import Float32Array, UInt8Array

RAYS, LIDAR = "rays", "lidar"
"""In view past all boxes; in view and no farther than LiDAR points."""


def seen_masks(
    frame: FrameRecord,
    grid: GridSpec,
    field_of_view: UInt8Array,
    kinds: Collection[str],
    points_level: Float32Array | None,
) -> dict[str, UInt8Array]:
    """Mark the cells of the field of view that are seen, once by each of some rules.

    - `rays`: no box of any category stands between the camera and the cell's centre on the flat ground,
      but one that the cell lies under (`unhidden_mask`).
    - `lidar`: the cell lies no farther from the LiDAR than the farthest point of its sector (`reached_mask`).

    Args:
        frame: the frame.
        grid: the grid.
        field_of_view: (rows, columns) uint8 0/1.
        kinds: of the two, which to make.
        points_level: (P, 4) points of the frame's sweep; needed for `lidar`.

    Returns:
        Kind → (rows, columns) uint8, 1 where the cell is seen.
    """
    masks: dict[str, UInt8Array] = {}
    if RAYS in kinds:
        eye_level = frame.level_from_camera[:3, 3]
        masks[RAYS] = unhidden_mask(grid, eye_level, frame.level_from_global, frame.boxes, field_of_view)
    if LIDAR in kinds and points_level is not None:
        reached = reached_mask(grid, frame.lidar_centre_level, points_level.astype(np.float64))
        masks[LIDAR] = reached & field_of_view
    return masks
