"""LiDAR points as a three-channel image on the BEV plane."""

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.typing import Float32Array

RANGE_SCALE_M = 100.0
"""The range that is 1 in the image."""
LOWEST_M, HEIGHT_SCALE_M = -3.0, 6.0
"""The height that is 0 in the image, and the span from there to the one that is 1."""
INTENSITY_SCALE = 255.0
"""The intensity that is 1 in the image; nuScenes' is 0 to 255."""


def lidar_image(points_level: Float32Array, grid: GridSpec) -> Float32Array:
    """Encode range, height and intensity of the highest point in each cell.

    The paper's "BEV 3-channels images that encode the distance to the LiDAR, the height and the intensity".
    Shards keep points in the level frame, so the distance is counted from its origin, about 2 m from the
    LiDAR.

    Args:
        points_level: (P, 4) x, y, z in metres, level frame, and intensity.
        grid: cells of the result.

    Returns:
        (3, rows, columns) float32, scaled to about 0 … 1; 0 in empty cells. Of points of the same height the
        last counts.
    """
    columns, rows = np.floor(grid.cells(points_level[:, :3].astype(np.float64)) + 0.5).T
    inside = (rows >= 0) & (rows < grid.rows) & (columns >= 0) & (columns < grid.columns)
    points = points_level[inside]
    order = np.argsort(points[:, 2], kind="stable")
    points = points[order]
    places = (rows[inside] * grid.columns + columns[inside]).astype(np.int64)[order]
    image = np.zeros((3, grid.rows * grid.columns), np.float32)
    # Where a place comes up again, the later value stays: the highest point's.
    image[0, places] = np.linalg.norm(points[:, :3], axis=1) / RANGE_SCALE_M
    image[1, places] = (points[:, 2] - LOWEST_M) / HEIGHT_SCALE_M
    image[2, places] = points[:, 3] / INTENSITY_SCALE
    return image.reshape(3, grid.rows, grid.columns)
