"""Pinhole projection; image pixels have their centre at integers (design.md §1)."""

import numpy as np

from ogmkit.geometry.se3 import inverse
from ogmkit.typing import FloatArray


def project(intrinsics: FloatArray, points_camera: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Project points of the camera frame (Hartley & Zisserman, 6.1).

    Args:
        intrinsics: (3, 3).
        points_camera: (..., 3), metres.

    Returns:
        (..., 2) pixels (u, v), meaningful only where the depth is positive, and (...) depth in metres.
    """
    homogeneous = points_camera @ intrinsics.T
    depth = homogeneous[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = homogeneous[..., :2] / depth[..., None]
    return pixels, depth


def image_from_ground(intrinsics: FloatArray, level_from_camera: FloatArray) -> FloatArray:
    """Homography from the plane z = 0 of the level frame to the image.

    Args:
        intrinsics: (3, 3).
        level_from_camera: (4, 4).

    Returns:
        (3, 3) float64 that maps (x, y, 1) in metres to pixels; its third coordinate is the depth in metres,
        so w > 0 means in front of the camera.
    """
    camera_from_level = inverse(level_from_camera)
    plane = camera_from_level[:3, [0, 1, 3]]
    homography: FloatArray = intrinsics @ plane
    return homography


def image_from_resized(image_size: tuple[int, int], resized: tuple[int, int]) -> FloatArray:
    """Pixels of an image from pixels of its resized copy: their corners coincide, not their first centres.

    The right form of the paper's misprinted S (design.md §2): u = s·(u' + 1/2) − 1/2 on each axis.

    Args:
        image_size: (height, width) of the image.
        resized: (height, width) of the copy.

    Returns:
        (3, 3) float64.
    """
    scale_v, scale_u = image_size[0] / resized[0], image_size[1] / resized[1]
    return np.array([[scale_u, 0.0, (scale_u - 1) / 2], [0.0, scale_v, (scale_v - 1) / 2], [0.0, 0.0, 1.0]])
