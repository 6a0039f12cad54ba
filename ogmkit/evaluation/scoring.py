"""Counting predictions against the truth, frame by frame."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.evaluation.baselines import ALL_DRIVABLE, Ceilings, all_drivable
from ogmkit.evaluation.camera_view import camera_view
from ogmkit.evaluation.controls import Controls
from ogmkit.evaluation.entrants import Entrant, no_grids
from ogmkit.evaluation.faces import vehicle_faces
from ogmkit.evaluation.frames import Frame, FrameReader
from ogmkit.evaluation.progress import Tick
from ogmkit.evaluation.result import Sample
from ogmkit.evaluation.runs import PredictedGrids
from ogmkit.evaluation.scope import Scope, paths, places
from ogmkit.evaluation.tally import Tally
from ogmkit.metrics.iou import CELLS, BevCounter, thresholded
from ogmkit.metrics.separation import Neighbours, count_separated, neighbours
from ogmkit.typing import IntArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Scored:
    """A run's counts.

    Attributes:
        tally: over all frames.
        samples: the predictions that were kept.
        unmasked: frames without valid masks to compare with: they don't count in camera view.
    """

    tally: Tally
    samples: tuple[Sample, ...]
    unmasked: int


class Scorer:
    """Counts on the frames of a scope.

    Args:
        scope: the frames.
        threshold: what probabilities must exceed.
        tick: called after every frame.
    """

    def __init__(self, scope: Scope, threshold: float, tick: Tick) -> None:
        self._scope = scope
        self._threshold = threshold
        self._tick = tick
        self._cells = BevCounter(scope.grid)

    def run(self, entrant: Entrant, found: Iterable[PredictedGrids], kept: Collection[int]) -> Scored:
        """Count a run's predictions.

        Args:
            entrant: the run.
            found: what it says of every frame.
            kept: numbers of the frames, in their order, whose predictions are kept.

        Raises:
            OgmkitError: as `ogmkit.learn.predict.run.predict_frames`.
            ShardError: a shard is damaged.
        """
        tally = self._tally(entrant.name)
        samples: list[Sample] = []
        unmasked, tuned = 0, entrant.run.thresholds
        with FrameReader(paths(self._scope.index)) as reader:
            for number, one in enumerate(found):
                if one.bev is None:
                    raise no_grids(entrant.run.path, entrant.name, self._scope.shards)
                place = one.scene, one.camera, one.frame
                frame, bev = reader.frame(place), thresholded(one.bev, self._threshold)
                view = None
                if entrant.masks is not None and one.image is not None:
                    view = camera_view(frame, entrant.masks, one.image)
                    unmasked += view is None
                tally.add(
                    one.scene,
                    self._bev_counts(frame, bev),
                    count_separated(self._pairs(frame), bev),
                    None if view is None else view.counts(self._threshold),
                )
                if tuned is not None:
                    cells = self._bev_counts(frame, thresholded(one.bev, tuned))
                    image = None if view is None else view.counts(tuned)
                    tally.add_tuned(one.scene, cells, image)
                if number in kept:
                    shown = None if one.image is None else thresholded(one.image, self._threshold)
                    samples.append(Sample(entrant.name, place, bev, shown))
                self._tick()
        return Scored(tally, tuple(samples), unmasked)

    def fixed(self, names: Sequence[str], controls: Controls, ceilings: Ceilings) -> tuple[Tally, ...]:
        """Count the rows that need no run, all in one pass.

        Raises:
            ShardError, SettingsError: a shard is damaged, or its images have no common size.
        """
        scope = self._scope
        tallies = {name: self._tally(name) for name in names}
        everywhere = all_drivable(scope.grid)
        controls.learn(self._tick)
        with FrameReader(paths(scope.index)) as reader:
            for place in places(scope.index):
                frame = reader.frame(place)
                codes = {ALL_DRIVABLE: everywhere, **controls.codes(frame), **ceilings.codes(frame)}
                pairs, in_view = self._pairs(frame), controls.in_view(frame)
                for name, code in codes.items():
                    counts = self._bev_counts(frame, code), count_separated(pairs, code)
                    tallies[name].add(frame.scene, *counts, in_view.get(name))
                self._tick()
        return tuple(tallies.values())

    def _bev_counts(self, frame: Frame, predicted: UInt8Array) -> IntArray:
        counts = self._cells.count(frame.truth, frame.field_of_view, predicted)
        further = (self._cells.count(frame.truth, seen, predicted) for seen in frame.seen.values())
        return np.concatenate([counts, *(one[:, :, 1:] for one in further)], axis=2)

    def _tally(self, name: str) -> Tally:
        scope = self._scope
        return Tally(name, scope.scenes, scope.definition, (*CELLS, *scope.seen))

    def _pairs(self, frame: Frame) -> Neighbours:
        faces = vehicle_faces(frame.shard, frame.camera, frame.index)
        return neighbours(faces, self._scope.grid, frame.truth, frame.field_of_view)
