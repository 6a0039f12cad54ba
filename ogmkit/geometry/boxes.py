"""Corners of oriented 3D boxes (x forward, y left, z up in the box's own frame)."""

import numpy as np

from ogmkit.geometry.se3 import transform_points
from ogmkit.typing import FloatArray

# Signs of x, y, z in half sizes. The first four corners are the top face's and bottom face's front in the
# devkit's order (nuscenes.utils.data_classes.Box.corners), so that edges can be drawn alike.
_CORNER_SIGNS = np.array(
    [[1, 1, 1], [1, -1, 1], [1, -1, -1], [1, 1, -1], [-1, 1, 1], [-1, -1, 1], [-1, -1, -1], [-1, 1, -1]],
    dtype=np.float64,
)
GROUND_FACE = (2, 3, 7, 6)
"""Indices of the ground face among the eight corners, in order round it (devkit: `Box.bottom_corners`)."""
FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), GROUND_FACE, (1, 2, 6, 5), (0, 3, 7, 4))
"""Corner indices of the six faces, each in order round it."""
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""Pairs of corner indices: the twelve edges, the front face's four first."""


def box_corners(frame_from_box: FloatArray, size_wlh: FloatArray) -> FloatArray:
    """All eight corners of boxes, in the devkit's order.

    Args:
        frame_from_box: (M, 4, 4) box poses in any frame.
        size_wlh: (M, 3) width (y), length (x), height (z); metres.

    Returns:
        (M, 8, 3) float64 in that frame.
    """
    half_xyz = size_wlh[:, None, [1, 0, 2]] / 2
    return transform_points(frame_from_box, _CORNER_SIGNS * half_xyz)


def ground_corners(frame_from_box: FloatArray, size_wlh: FloatArray) -> FloatArray:
    """The four corners of each box's ground face: (M, 4, 3), in order round the face."""
    return box_corners(frame_from_box, size_wlh)[:, list(GROUND_FACE)]
