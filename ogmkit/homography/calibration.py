"""Homography of a flat world: the calibration and the plane z = 0 of the level frame."""

import numpy as np

from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.plane import level_from_image
from ogmkit.homography.projective import determinants
from ogmkit.homography.result import Estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import IntArray


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `calibration`: no box has a say in it, whatever the settings."""
    del settings
    batch = len(left_out)
    planes = np.zeros((batch, 3))
    matrix = level_from_image(frame, planes)
    reason = "" if determinants(matrix)[0] < 0 else "the camera is not above the ground"
    return Estimates(matrix, (reason,) * batch, np.zeros(batch, dtype=np.int64), planes)
