"""Controls that learn, but see no image: one answer for all frames of a camera."""

from collections.abc import Mapping, Sequence

import numpy as np

from ogmkit.evaluation.baselines import MEAN_MAP, mean_maps, on_grid
from ogmkit.evaluation.camera_view import camera_view, mean_masks
from ogmkit.evaluation.frames import Frame, FrameReader
from ogmkit.evaluation.progress import Tick
from ogmkit.evaluation.scope import Scope, masks_problem, paths, places
from ogmkit.footprints.sets import FULL_BODY
from ogmkit.metrics.iou import thresholded
from ogmkit.samples.splits import TRAIN
from ogmkit.typing import Float32Array, IntArray, UInt8Array

MEAN_MASK = "mean-mask"


class Controls:
    """Means over the scenes to learn from: of the rasters, and of masks in camera view.

    The mean mask is laid on the grid as networks' masks are: by each frame's own homography.

    Args:
        scope: what is evaluated, and the scenes to learn from.
        masks: the set in camera view; None leaves the mean mask out.
        threshold: what shares must exceed.
    """

    def __init__(self, scope: Scope, masks: str | None, threshold: float) -> None:
        self._scope = scope
        self._masks = masks
        self._threshold = threshold
        self._maps: Mapping[str, UInt8Array] = {}
        self._shares: Mapping[str, Float32Array] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Of the rows."""
        if self._scope.training is None:
            return ()
        return (MEAN_MAP,) if self._masks is None else (MEAN_MAP, MEAN_MASK)

    @property
    def frames(self) -> int:
        """How many frames `learn` reads, each counted once a row."""
        return 0 if self._scope.training is None else len(self.names) * len(self._scope.training)

    def learn(self, tick: Tick) -> None:
        """Read the scenes to learn from.

        Args:
            tick: called after every frame.

        Raises:
            ShardError: a shard is absent or damaged.
        """
        training = self._scope.training
        if training is None:
            return
        with FrameReader(paths(training)) as reader:
            self._maps = mean_maps(reader, places(training), self._scope.grid, self._threshold, tick)
            if self._masks is not None:
                self._shares = mean_masks(reader, places(training), self._masks, tick)

    def codes(self, frame: Frame) -> Mapping[str, UInt8Array]:
        """Row → (rows, columns) code; empty where a limit has left the camera without training frames."""
        codes = {name: np.zeros_like(frame.truth) for name in self.names}
        if frame.camera in self._maps:
            codes[MEAN_MAP] = self._maps[frame.camera]
        if frame.camera in self._shares and self._scope.homography is not None:
            mask = thresholded(self._shares[frame.camera], self._threshold)
            codes[MEAN_MASK] = on_grid(frame, mask, self._scope.homography)
        return codes

    def in_view(self, frame: Frame) -> Mapping[str, IntArray]:
        """Row → counts of its pixels; none where the frame or its camera has no masks."""
        if self._masks is None or frame.camera not in self._shares:
            return {}
        view = camera_view(frame, self._masks, self._shares[frame.camera])
        return {} if view is None else {MEAN_MASK: view.counts(self._threshold)}


def mean_mask_set(scope: Scope, masks_learnt: Sequence[str]) -> tuple[str | None, str]:
    """The set that the mean mask is of: what the networks learn, else what the homography's own is called.

    Args:
        scope: what is evaluated.
        masks_learnt: sets that runs have learnt; whole bodies don't count.

    Returns:
        The set, or None where shards lack it; and a note to be read with the row, or with its absence.
    """
    if scope.training is None or scope.homography is None:
        return None, ""
    chosen = next((name for name in masks_learnt if name != FULL_BODY), scope.homography)
    for index in (scope.index, scope.training):
        problem = masks_problem(scope.shards, index, chosen)
        if problem:
            return None, f"no {MEAN_MASK}: {problem}"
    return chosen, f"{MEAN_MASK}: of masks {chosen!r}, and compared with them in camera view"


def control_notes(scope: Scope, names: Sequence[str]) -> list[str]:
    """What is to be known of the scenes that they have learnt from."""
    if scope.training is None:
        return [f"no {MEAN_MAP}: there is no split {TRAIN!r} to take it from"]
    if {*scope.training.scenes} & {*scope.scenes}:
        return [f"{name} has seen scenes of this split" for name in names]
    return []
