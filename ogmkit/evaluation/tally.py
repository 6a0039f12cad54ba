"""Counts of one system by scene, and the figures they make."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ogmkit.evaluation.result import Figure, SceneCounts
from ogmkit.metrics.bootstrap import estimate
from ogmkit.metrics.iou import BEV_SHAPE, CELLS, IMAGE_SHAPE, IOUS, TUNED_IOU, iou
from ogmkit.metrics.regions import REGIONS
from ogmkit.metrics.separation import COUNTS, PAIR_METRICS
from ogmkit.samples.spec import TARGETS
from ogmkit.typing import FloatArray, IntArray


class Tally:
    """Adds up a system's counts.

    Args:
        system: its name in the table.
        scenes: names of the scenes with frames.
        definition: of the labels.
        cells: what the third axis of counts is.
    """

    def __init__(
        self, system: str, scenes: Sequence[str], definition: str, cells: Sequence[str] = CELLS
    ) -> None:
        self.system = system
        self._definition = definition
        self._row = {scene: row for row, scene in enumerate(scenes)}
        self._cells = cells
        targets, regions, _, outcomes = BEV_SHAPE
        self._bev = np.zeros((len(scenes), targets, regions, len(cells), outcomes), np.int64)
        self._image = np.zeros((len(scenes), *IMAGE_SHAPE), np.int64)
        self._pairs = np.zeros((len(scenes), len(COUNTS)), np.int64)
        self._tuned_bev = np.zeros_like(self._bev)
        self._tuned_image = np.zeros_like(self._image)

    def add(self, scene: str, bev: IntArray, pairs: IntArray, image: IntArray | None = None) -> None:
        """Add a frame's counts of cells, of pairs of vehicles, and of pixels where there are any."""
        row = self._row[scene]
        self._bev[row] += bev
        self._pairs[row] += pairs
        if image is not None:
            self._image[row] += image

    def add_tuned(self, scene: str, bev: IntArray, image: IntArray | None = None) -> None:
        """Add a frame's counts of cells and pixels at the run's own thresholds."""
        row = self._row[scene]
        self._tuned_bev[row] += bev
        if image is not None:
            self._tuned_image[row] += image

    def by_scene(self) -> SceneCounts:
        """All counts so far."""
        return SceneCounts(self._bev, self._image, self._tuned_bev, self._pairs)

    def figures(self) -> Iterator[Figure]:
        """Every IoU, NaN where a system has none; then what neighbours are told apart."""
        yield from self._iou_figures(self._image, self._bev, IOUS)
        yield from self._iou_figures(self._tuned_image, self._tuned_bev, (TUNED_IOU,))
        yield from self._pair_figures()

    def _iou_figures(
        self, image_counts: IntArray, bev_counts: IntArray, kinds: Sequence[str]
    ) -> Iterator[Figure]:
        """The first of the two IoUs, or both, by the names that they are given."""
        image, bev = estimate(image_counts, iou), estimate(bev_counts, iou)
        for t, target in enumerate(TARGETS):
            for i, kind in enumerate(kinds):
                values = (float(one[t, i]) for one in (image.value, image.low, image.high))
                yield self._figure(target, "camera", "full", "all", kind, *values)
            for place in np.ndindex(len(REGIONS), len(self._cells), len(kinds)):
                names = (names[at] for names, at in zip((REGIONS, self._cells, kinds), place, strict=True))
                values = (float(one[t][place]) for one in (bev.value, bev.low, bev.high))
                yield self._figure(target, "bev", *names, *values)

    def _pair_figures(self) -> Iterator[Figure]:
        """How many neighbours there are, how many are found, and how many of those are told apart."""
        share = estimate(self._pairs, _separated_share)
        pairs, found, _ = self._pairs.sum(axis=0).tolist()
        intervals = (
            (pairs, math.nan, math.nan),
            (found, math.nan, math.nan),
            (share.value, share.low, share.high),
        )
        for metric, values in zip(PAIR_METRICS, intervals, strict=True):
            yield self._figure("vehicles", "bev", "full", "fov", metric, *map(float, values))

    def _figure(self, *values: Any) -> Figure:  # noqa: ANN401  # of Figure's fields, but for the first
        return Figure(self.system, *values, definition=self._definition)


def _separated_share(counts: IntArray) -> FloatArray:
    with np.errstate(invalid="ignore"):
        return np.asarray(counts[..., 2] / counts[..., 1])
