"""Intersection over union of drivable area and vehicles, from counts that add up over frames."""

from collections.abc import Sequence

import cv2
import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.metrics.regions import REGIONS, region_masks
from ogmkit.samples.spec import TARGETS
from ogmkit.typing import Float32Array, FloatArray, IntArray, UInt8Array

DRIVABLE, VEHICLES = 1, 2
"""Bits of a code: a (height, width) uint8 array that holds both masks of a frame."""

CELLS = ("all", "fov")
"""Every cell; those in the camera's field of view."""
IOUS = ("foreground_iou", "mean_iou")
"""Of the positive class; the mean of it and the negative class's."""
TUNED_IOU = "tuned_iou"
"""Of the positive class, at thresholds that were chosen on other frames."""
OUTCOMES = ("tp", "fp", "fn", "tn")
"""What a cell counts as: the last axis of every array of counts."""

_TRUTH_SHIFT, _VIEW_SHIFT, _REGION_SHIFT = 2, 4, 5
_CLOSE, _FAR = 1, 2
_BINS = (4, 2, 2, 2, 2, 2)
"""Of a cell: region, field of view, truth (vehicles, drivable), prediction (vehicles, drivable)."""


def code_of(drivable: UInt8Array, vehicles: UInt8Array) -> UInt8Array:
    """The code of two masks of one shape, uint8 0/1."""
    return drivable | vehicles << np.uint8(1)


def masks_of(code: UInt8Array) -> tuple[UInt8Array, UInt8Array]:
    """The two masks of a code, drivable and vehicles, uint8 0/1."""
    return code & np.uint8(DRIVABLE), code >> np.uint8(1)


def thresholded(probabilities: Float32Array, thresholds: float | Sequence[float]) -> UInt8Array:
    """The code of (2, height, width) probabilities: set where they are over a threshold, or each its own."""
    each = np.broadcast_to(thresholds, len(TARGETS))
    drivable, vehicles = (
        (one > threshold).view(np.uint8) for one, threshold in zip(probabilities, each, strict=True)
    )
    return code_of(drivable, vehicles)


def resized(probabilities: Float32Array, size: tuple[int, int]) -> Float32Array:
    """(2, h, w) probabilities at another (height, width), linear between pixels, corners on corners."""
    if probabilities.shape[1:] == size:
        return probabilities
    maps = [cv2.resize(one, size[::-1], interpolation=cv2.INTER_LINEAR) for one in probabilities]
    return np.stack(maps).astype(np.float32, copy=False)


class BevCounter:
    """Counts the cells of a grid's frames; all regions and both kinds of cells in one pass.

    Args:
        grid: of all frames.
    """

    def __init__(self, grid: GridSpec) -> None:
        masks = region_masks(grid)
        region = np.where(masks["close"], _CLOSE, np.where(masks["far"], _FAR, 0))
        self._region = (region << _REGION_SHIFT).astype(np.uint8)

    def count(self, truth: UInt8Array, field_of_view: UInt8Array, predicted: UInt8Array) -> IntArray:
        """Count one frame.

        Args:
            truth: (rows, columns) code.
            field_of_view: (rows, columns) uint8 0/1.
            predicted: (rows, columns) code.

        Returns:
            (target, region, cells, outcome) int64, in the order of `TARGETS`, `REGIONS`, `CELLS`, `OUTCOMES`.
        """
        code = self._region | field_of_view << np.uint8(_VIEW_SHIFT)
        code |= truth << np.uint8(_TRUTH_SHIFT)
        code |= predicted
        cells = np.bincount(code.ravel(), minlength=np.prod(_BINS)).reshape(_BINS)
        regions = np.stack([cells.sum(axis=0), cells[_CLOSE], cells[_FAR]])
        kinds = np.stack([regions.sum(axis=1), regions[:, 1]], axis=1)
        return _outcomes(kinds)


def count_image(truth: UInt8Array, predicted: UInt8Array) -> IntArray:
    """Count the pixels of one frame in camera view.

    Args:
        truth: (height, width) code.
        predicted: the same.

    Returns:
        (target, outcome) int64.
    """
    code = truth << np.uint8(_TRUTH_SHIFT) | predicted
    return _outcomes(np.bincount(code.ravel(), minlength=16).reshape(2, 2, 2, 2))


def _outcomes(cells: IntArray) -> IntArray:
    """(target, …, outcome) from (…, true vehicles, true drivable, predicted vehicles, predicted drivable)."""
    drivable, vehicles = cells.sum(axis=(-4, -2)), cells.sum(axis=(-3, -1))
    by_target = np.stack([drivable, vehicles])
    places = ((1, 1), (0, 1), (1, 0), (0, 0))
    return np.stack([by_target[..., true, predicted] for true, predicted in places], axis=-1)


def iou(counts: IntArray) -> FloatArray:
    """IoU from sums of counts.

    Args:
        counts: (…, outcome).

    Returns:
        (…, 2) float64, foreground and mean; NaN where a union is empty.
    """
    tp, fp, fn, tn = (counts[..., outcome].astype(np.float64) for outcome in range(len(OUTCOMES)))
    with np.errstate(invalid="ignore"):
        foreground, background = tp / (tp + fp + fn), tn / (tn + fp + fn)
    return np.stack([foreground, (foreground + background) / 2], axis=-1)


BEV_SHAPE = (len(TARGETS), len(REGIONS), len(CELLS), len(OUTCOMES))
IMAGE_SHAPE = (len(TARGETS), len(OUTCOMES))
