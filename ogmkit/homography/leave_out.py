"""Errors of boxes that were left out of the fit: the honest measure where roads are not flat."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ogmkit.homography.corners import usable_boxes
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.methods import estimator
from ogmkit.homography.projective import apply
from ogmkit.homography.result import Estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import BoolArray, FloatArray, IntArray

RANGES_M = ((0.0, 20.0), (20.0, 40.0), (40.0, 60.0))
"""Ranges of box centres from the ego that errors are reported by; the far end excluded."""

EVALUATED = FitSettings()
"""Which boxes are left out and measured: the same whatever a method is fitted to, so that methods compare."""


@dataclass(frozen=True, eq=False)
class LeftOutErrors:
    """Errors of one method in one frame, by box; M boxes.

    Attributes:
        evaluated: (M,) whether the box was left out and measured.
        refused: (M,) whether the method refused to answer without it.
        error_m: (M,) mean distance of its four ground corners in the BEV from where the homography fitted
            without it puts them; infinite if one of them lies above the horizon; NaN if refused or not
            evaluated.
        range_m: (M,) of the box's centre from the ego.
    """

    evaluated: BoolArray
    refused: BoolArray
    error_m: FloatArray
    range_m: FloatArray


@dataclass(frozen=True)
class RangeSummary:
    """Left-out errors of the boxes in one range, over any number of frames.

    Attributes:
        from_m: nearest range.
        to_m: farthest range, excluded.
        boxes: how many were evaluated.
        median_m: over those not refused; NaN without any.
        p90_m: 90th percentile likewise.
        refused_share: of the evaluated, 0 to 1; NaN without any.
    """

    from_m: float
    to_m: float
    boxes: int
    median_m: float
    p90_m: float
    refused_share: float


def left_out_errors(method: str, frame: FrameGeometry, settings: FitSettings) -> LeftOutErrors:
    """Leave out each vehicle that design.md §2 evaluates on in turn, fit without it and measure it.

    An object stands once in a frame and the methods know only that frame: no other box of its track helps.

    Args:
        method: a key of `METHODS`.
        frame: camera and boxes.
        settings: which corners count for the fit; what is evaluated does not depend on them.

    Raises:
        SettingsError: the method is unknown.
    """
    estimate = estimator(method)
    return box_errors(frame, lambda boxes: estimate(frame, boxes, settings))


def box_errors(frame: FrameGeometry, estimate: Callable[[IntArray], Estimates]) -> LeftOutErrors:
    """Measure what is found without each vehicle that design.md §2 evaluates on.

    Args:
        frame: camera and boxes.
        estimate: (B,) indices of boxes → an estimate without each of them, or one for all that knows none.
    """
    evaluated = usable_boxes(frame, EVALUATED)
    refused = np.zeros(len(frame), dtype=bool)
    error_m = np.full(len(frame), np.nan)
    boxes = np.flatnonzero(evaluated)
    if len(boxes):
        found = estimate(boxes)
        mapped, w = apply(found.level_from_image, frame.ground_corners_px[boxes])
        offset = mapped - frame.ground_corners_level[boxes, :, :2]
        mean = np.hypot(offset[..., 0], offset[..., 1]).mean(axis=1)
        refused[boxes] = ~found.valid
        error_m[boxes] = np.where(found.valid, np.where((w > 0).all(axis=1), mean, np.inf), np.nan)
    return LeftOutErrors(evaluated, refused, error_m, frame.range_m)


def summarise(errors: Iterable[LeftOutErrors]) -> tuple[RangeSummary, ...]:
    """Median, 90th percentile and share refused by range, over all boxes of all frames given."""
    columns = [np.stack([one.range_m, one.error_m, one.refused])[:, one.evaluated] for one in errors]
    range_m, error_m, refused = np.concatenate([np.empty((3, 0)), *columns], axis=1)
    summaries = []
    for from_m, to_m in RANGES_M:
        inside = (range_m >= from_m) & (range_m < to_m)
        answered = error_m[inside & (refused == 0)]
        summaries.append(
            RangeSummary(
                from_m=from_m,
                to_m=to_m,
                boxes=int(inside.sum()),
                median_m=_quantile(answered, 0.5),
                p90_m=_quantile(answered, 0.9),
                refused_share=float(refused[inside].mean()) if inside.any() else float("nan"),
            )
        )
    return tuple(summaries)


def _quantile(values: FloatArray, share: float) -> float:
    """As numpy's linear quantile, but infinite beside an infinite value; NaN without values."""
    if not len(values):
        return float("nan")
    ordered = np.sort(values)
    place = share * (len(values) - 1)
    lower, upper = float(ordered[math.floor(place)]), float(ordered[math.ceil(place)])
    # numpy would subtract infinite from infinite.
    return lower + (place % 1) * (upper - lower) if math.isfinite(upper) and upper > lower else upper
