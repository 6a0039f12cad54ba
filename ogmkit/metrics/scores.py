"""Scores of predictions of your own, with intervals from resampling scenes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.metrics.bootstrap import Estimate, estimate
from ogmkit.metrics.displacement import means_of, own_values, scene_sums
from ogmkit.metrics.iou import BevCounter, code_of, iou
from ogmkit.metrics.plan import STEPS
from ogmkit.metrics.plans import points_only
from ogmkit.typing import FloatArray, IntArray, UInt8Array

Mask = NDArray[np.uint8] | NDArray[np.bool_]
"""Of 0 and 1."""


class IouTally:
    """Intersection over union of drivable area and vehicles, summed over frames.

    Args:
        grid: of all frames.
    """

    def __init__(self, grid: GridSpec) -> None:
        self._shape = grid.shape
        self._counter = BevCounter(grid)
        self._counts: dict[str, IntArray] = {}

    def add(self, scene: str, truth: Mask, predicted: Mask, field_of_view: Mask) -> None:
        """Count one frame.

        Args:
            scene: the scene that it belongs to.
            truth: (2, rows, columns) 0/1, drivable and vehicles.
            predicted: the same.
            field_of_view: (rows, columns) 0/1.

        Raises:
            SettingsError: an array has another shape.
        """
        seen = self._mask(field_of_view, "field of view", self._shape)
        codes = (
            code_of(*self._mask(masks, name, (2, *self._shape)))
            for masks, name in ((truth, "truth"), (predicted, "prediction"))
        )
        true, found = codes
        self._counts[scene] = self._counts.get(scene, 0) + self._counter.count(true, seen, found)

    def result(self) -> Estimate:
        """The figures of all frames so far.

        Returns:
            (2, 3, 2, 2) arrays: drivable, vehicles; regions full, close, far; all cells, those in the field
            of view; the foreground's IoU, its mean with the background's. NaN where a union is empty.

        Raises:
            SettingsError: no frame was added.
        """
        if not self._counts:
            raise SettingsError("IoU: no frame was added")
        return estimate(np.stack([self._counts[scene] for scene in sorted(self._counts)]), iou)

    @staticmethod
    def _mask(mask: Mask, name: str, shape: tuple[int, ...]) -> UInt8Array:
        if mask.shape != shape:
            raise SettingsError(f"IoU: {name} has shape {mask.shape}, expected {shape}")
        return np.asarray(mask, dtype=np.bool_).view(np.uint8)


def displacement_errors(predicted: FloatArray, truth: FloatArray, scenes: Sequence[str]) -> Estimate:
    """Mean distance between predicted and true positions, 0.5, 1.5 and 2.5 s ahead.

    Args:
        predicted: (N, 5, 2) positions at steps 1 … 5, 0.5 s apart, metres.
        truth: (N, 5, 2) the same; a point that is NaN doesn't count.
        scenes: N names, the scene of each.

    Returns:
        (3, 2) arrays in metres: each horizon; at its point, and the mean over the points up to it.

    Raises:
        SettingsError: shapes disagree, or there is nothing to score.
    """
    names, scene = np.unique(np.asarray(list(scenes), dtype=np.str_), return_inverse=True)
    expected = (len(scene), STEPS, 2)
    if predicted.shape != expected or truth.shape != expected or not len(scene):
        raise SettingsError(
            f"displacement: positions of {len(scene)} scenes' samples have shapes {predicted.shape} and "
            f"{truth.shape}, expected (N, {STEPS}, 2) twice, N ≥ 1"
        )
    distances = own_values(points_only(predicted), truth)[:1]
    return estimate(scene_sums(distances, scene, len(names))[:, 0], means_of)
