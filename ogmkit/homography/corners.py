"""Corners of boxes that a homography may be fitted to, and whether they are enough."""

from dataclasses import dataclass

import numpy as np

from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.settings import FitSettings
from ogmkit.raster.vehicles import observed
from ogmkit.typing import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Corners:
    """Ground corners of usable boxes in both planes, four in a row for each box; N corners.

    Attributes:
        pixels: (N, 2) in the image.
        positions_m: (N, 2) x, y in the level frame.
        box: (N,) the box's index in the frame.
    """

    pixels: FloatArray
    positions_m: FloatArray
    box: IntArray

    def kept(self, left_out: IntArray) -> BoolArray:
        """(B, N) the corners that remain when box `left_out[b]` is left out; −1 leaves out none."""
        remain: BoolArray = self.box != left_out[:, None]
        return remain


def usable_boxes(frame: FrameGeometry, settings: FitSettings) -> BoolArray:
    """(M,) boxes whose corners may be fitted to (design.md §2): wholly visible, near, of the categories."""
    wanted = np.array([name.startswith(settings.categories) for name in frame.category], dtype=bool)
    clear = observed(
        frame.visibility, frame.num_lidar_pts, settings.min_visibility, settings.min_lidar_points
    )
    usable: BoolArray = wanted & clear & frame.wholly_visible & (frame.range_m <= settings.max_distance_m)
    return usable


def usable_corners(frame: FrameGeometry, settings: FitSettings) -> Corners:
    """The corners of all usable boxes of a frame."""
    boxes = np.flatnonzero(usable_boxes(frame, settings))
    return Corners(
        pixels=frame.ground_corners_px[boxes].reshape(-1, 2),
        positions_m=frame.ground_corners_level[boxes, :, :2].reshape(-1, 2),
        box=np.repeat(boxes, 4),
    )


def shortcomings(corners: Corners, kept: BoolArray, min_points: int, min_spread_m: float) -> list[str]:
    """Why each subset of corners is not enough for a fit: B reasons, empty where it is.

    Args:
        corners: N corners.
        kept: (B, N) the subsets.
        min_points: fewest corners.
        min_spread_m: least standard deviation of the positions over all directions.
    """
    counts = kept.sum(axis=1)
    spread_m = least_spread_m(corners.positions_m, kept)
    reasons = []
    for count, spread in zip(counts.tolist(), spread_m.tolist(), strict=True):
        if count < min_points:
            reasons.append(f"{count} usable corners, fewer than {min_points}")
        elif spread < min_spread_m:
            reasons.append(f"corners spread over only {spread:.2f} m, less than {min_spread_m:g} m")
        else:
            reasons.append("")
    return reasons


def least_spread_m(positions_m: FloatArray, kept: BoolArray) -> FloatArray:
    """Least standard deviation, over all directions, of each (B, N) subset of (N, 2) positions; (B,) metres.

    The square root of the covariance's smaller eigenvalue; 0 for an empty subset.
    """
    share = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1)
    # About the overall mean first: the squares of differences of far points keep their digits.
    offset = positions_m - (positions_m.mean(axis=0) if len(positions_m) else 0.0)
    mean = share @ offset
    square = share @ np.stack([offset[:, 0] ** 2, offset[:, 1] ** 2, offset[:, 0] * offset[:, 1]], axis=1)
    xx, yy = square[:, 0] - mean[:, 0] ** 2, square[:, 1] - mean[:, 1] ** 2
    xy = square[:, 2] - mean[:, 0] * mean[:, 1]
    smaller: FloatArray = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
    least: FloatArray = np.sqrt(np.maximum(smaller, 0.0))
    return least
