"""The paper's own fit: OpenCV's exact homography through the four corners of one box."""

import cv2
import numpy as np

from ogmkit.homography.corners import shortcomings, usable_corners
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.result import Estimates, estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import Float32Array, FloatArray, IntArray


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `four-point`: `cv2.getPerspectiveTransform` on the ground corners of the nearest usable box."""
    corners = usable_corners(frame, settings)
    nearest_first = np.argsort(frame.range_m[corners.box], kind="stable")
    corner_kept = corners.kept(left_out)
    chosen = np.zeros_like(corner_kept)
    matrices = np.full((len(left_out), 3, 3), np.nan)
    for b, kept in enumerate(corner_kept):
        four = nearest_first[kept[nearest_first]][:4]
        chosen[b, four] = True
        if len(four) == 4:
            matrices[b] = _through(corners.pixels[four], corners.positions_m[four])
    reasons = shortcomings(corners, chosen, 4, settings.min_spread_m)
    return estimates(matrices, reasons, chosen.sum(axis=1), corners.pixels, chosen)


def _through(pixels: FloatArray, positions_m: FloatArray) -> FloatArray:
    """OpenCV takes nothing wider than float32 here."""
    source: Float32Array = pixels.astype(np.float32)
    destination: Float32Array = positions_m.astype(np.float32)
    return np.asarray(cv2.getPerspectiveTransform(source, destination), dtype=np.float64)
