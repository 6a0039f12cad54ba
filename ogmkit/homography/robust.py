"""Homography from corners of which some are wrong: boxes that float above the road or sink into it."""

import numpy as np

from ogmkit.homography.corners import shortcomings, usable_corners
from ogmkit.homography.dlt import degeneracies, direct_linear_transformation, refine
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.projective import inverse_or_nan
from ogmkit.homography.result import Estimates, estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import IntArray

LEAST_POINTS = 8
"""Two boxes: of one alone nobody can tell whether it floats."""
_SOFT_L1_PX = 1.0


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `robust`: reweighted least squares of the distances in the image, from a DLT BEV → image.

    The loss is soft-L1 with its turn at 1 px, so a corner far off counts by its distance and no longer by
    its square. Nothing is drawn by chance: the same corners give the same matrix.
    """
    corners = usable_corners(frame, settings)
    kept = corners.kept(left_out)
    weights = kept.astype(np.float64)
    reasons = shortcomings(corners, kept, settings.min_points or LEAST_POINTS, settings.min_spread_m)
    linear, condition = direct_linear_transformation(corners.positions_m, corners.pixels, weights)
    reasons = degeneracies(reasons, condition)
    turn_px = np.full(len(left_out), _SOFT_L1_PX)
    image_from_level = refine(linear, corners.positions_m, corners.pixels, weights, soft_l1=turn_px)
    matrix = inverse_or_nan(image_from_level)
    return estimates(matrix, reasons, kept.sum(axis=1), corners.pixels, kept)
