"""Homography of a ground that tilts as the body does: calibration and the plane z = 0 of the ego frame."""

import numpy as np

from ogmkit.homography.calibration import over_plane
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.result import Estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import FloatArray, IntArray


def ego_plane(frame: FrameGeometry) -> FloatArray:
    """(3,) coefficients of z = p0 + p1·x + p2·y, level frame: the ground parallel to the body's xy plane.

    It runs through the ego's origin, which the level frame shares; NaN where the body stands on its side.
    """
    x, y, z = frame.level_from_ego[:3, 2]
    return np.array([0.0, -x / z, -y / z]) if z > 0 else np.full(3, np.nan)


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `ego-plane`: nothing is fitted, whatever the settings."""
    del settings
    return over_plane(frame, ego_plane(frame), len(left_out))
