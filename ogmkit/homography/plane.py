"""Homography of the local ground plane of a calibrated camera: three numbers instead of eight."""

import numpy as np

from ogmkit.geometry.camera import project
from ogmkit.homography.corners import Corners, shortcomings, usable_corners
from ogmkit.homography.dlt import LEAST_POINTS
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.least_squares import Model, minimise
from ogmkit.homography.projective import inverse_or_nan
from ogmkit.homography.result import Estimates, estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import FloatArray, IntArray

_SOFT_L1_PX = 1.0
_STEPS = 15


def level_from_image(frame: FrameGeometry, planes: FloatArray) -> FloatArray:
    """Homographies from the image to the (x, y) of the level frame over ground planes.

    Args:
        frame: the calibrated camera.
        planes: (B, 3) coefficients of z = p0 + p1·x + p2·y, metres, level frame.

    Returns:
        (B, 3, 3) float64, w > 0 in front of the camera; NaN where the plane runs through the camera.
    """
    camera_from_level = frame.camera_from_level
    lifted = np.zeros((len(planes), 3, 3))
    lifted[:, 0, 0] = lifted[:, 1, 1] = 1.0
    lifted[:, 2] = planes[:, [1, 2, 0]]
    camera_from_plane = camera_from_level[:3, :3] @ lifted
    camera_from_plane[:, :, 2] += camera_from_level[:3, 3]
    return inverse_or_nan(frame.intrinsics @ camera_from_plane)


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `plane`: the plane whose points (x, y) of the corners project nearest to the corners themselves.

    The loss is soft-L1 of the distances in the image, its turn at 1 px; the start is z = 0.
    """
    corners = usable_corners(frame, settings)
    kept = corners.kept(left_out)
    reasons = shortcomings(corners, kept, settings.min_points or LEAST_POINTS, settings.min_spread_m)
    start = np.zeros((len(left_out), 3))
    turn_px = np.full(len(left_out), _SOFT_L1_PX)
    weights = kept.astype(np.float64)
    planes = minimise(start, _model(frame, corners), weights, steps=_STEPS, soft_l1=turn_px)
    matrix = level_from_image(frame, planes)
    return estimates(matrix, reasons, kept.sum(axis=1), corners.pixels, kept, planes)


def _model(frame: FrameGeometry, corners: Corners) -> Model:
    """Residuals in pixels of corners moved vertically onto a plane, and their derivatives."""
    ones = np.ones((len(corners.box), 1))
    basis = np.concatenate([ones, corners.positions_m], axis=1)
    flat_camera = (
        np.concatenate([corners.positions_m, 0 * ones, ones], axis=1) @ frame.camera_from_level[:3].T
    )
    up_camera = frame.camera_from_level[:3, 2]

    def model(planes: FloatArray) -> tuple[FloatArray, FloatArray]:
        height_m = planes @ basis.T
        pixels, depth_m = project(frame.intrinsics, flat_camera + height_m[..., None] * up_camera)
        up_image = frame.intrinsics @ up_camera
        with np.errstate(divide="ignore", invalid="ignore"):
            by_height = (up_image[:2] - pixels * up_image[2]) / depth_m[..., None]
        jacobian = by_height[..., None] * basis[:, None, :]
        return pixels - corners.pixels, jacobian

    return model
