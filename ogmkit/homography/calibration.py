"""Homography of a flat world: the calibration and the plane z = 0 of the level frame."""

import numpy as np

from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.plane import level_from_image
from ogmkit.homography.projective import determinants
from ogmkit.homography.result import Estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import FloatArray, IntArray


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `calibration`: no box has a say in it, whatever the settings."""
    del settings
    return over_plane(frame, np.zeros(3), len(left_out))


def over_plane(frame: FrameGeometry, plane: FloatArray, count: int) -> Estimates:
    """The calibrated camera's homography of a known ground, the same in all variants of the frame.

    Args:
        frame: the calibrated camera.
        plane: (3,) coefficients of z = p0 + p1·x + p2·y, metres, level frame.
        count: of variants.
    """
    planes = np.tile(plane, (count, 1))
    matrix = level_from_image(frame, planes)
    reason = "" if determinants(matrix)[0] < 0 else "the camera is not above the ground"
    return Estimates(matrix, (reason,) * count, np.zeros(count, dtype=np.int64), planes)
