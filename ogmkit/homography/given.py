"""Homographies that come from elsewhere: from a network, or from a user."""

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.homography.projective import determinants
from ogmkit.homography.result import Estimates, estimates
from ogmkit.typing import FloatArray


def estimate(bev_from_image: FloatArray, image_size: tuple[int, int], grid: GridSpec) -> Estimates:
    """Give a homography its sign, or refuse it: the middle of the image's bottom edge sees the ground.

    Args:
        bev_from_image: (3, 3) float64 from pixels to cells, of any scale and sign.
        image_size: (height, width) in pixels.
        grid: of the cells.

    Returns:
        One estimate that rests on no point; invalid where the matrix is not finite or singular, or shows the
        ground from below.
    """
    regular = bool(determinants(bev_from_image[None])[0])
    matrix = grid.level_from_bev @ bev_from_image if regular else np.full((3, 3), np.nan)
    height, width = image_size
    bottom_px = np.array([[(width - 1) / 2, height - 1.0]])
    reasons = [""] if regular else ["the homography is singular or not finite"]
    return estimates(matrix[None], reasons, np.zeros(1, np.int64), bottom_px, np.ones((1, 1), np.bool_))
