"""Frames in camera view: masks as a set has them, and what is predicted beside them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.evaluation.frames import Frame, FrameReader, Place, row
from ogmkit.metrics.iou import code_of, count_image, masks_of, resized, thresholded
from ogmkit.samples.spec import TARGETS
from ogmkit.shards.reader import Shard
from ogmkit.typing import Float32Array, IntArray, UInt8Array


@dataclass(frozen=True, eq=False)
class CameraView:
    """A frame in camera view, at the size of its masks.

    Attributes:
        truth: (h, w) code.
        probabilities: (2, h, w).
    """

    truth: UInt8Array
    probabilities: Float32Array

    def counts(self, thresholds: float | Sequence[float]) -> IntArray:
        """Counts of the pixels."""
        return count_image(self.truth, thresholded(self.probabilities, thresholds))


def camera_view(frame: Frame, masks: str, probabilities: Float32Array) -> CameraView | None:
    """A prediction beside a set of masks; None where that has none for the frame."""
    truth = _code(frame.shard, frame.camera, frame.index, masks)
    return None if truth is None else CameraView(truth, resized(probabilities, truth.shape))


def mean_masks(
    reader: FrameReader, places: Iterable[Place], masks: str, tick: Callable[[], None]
) -> Mapping[str, Float32Array]:
    """Each camera's mean mask in camera view.

    Args:
        reader: of the scenes to learn from.
        places: their frames; those without valid masks don't count.
        masks: the set.
        tick: called after every frame.

    Returns:
        Camera → (2, h, w) share of the frames that have a pixel set, at the size of its first frame's masks;
        no entry for a camera without valid masks.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    sums: dict[str, Float32Array] = {}
    counts: dict[str, int] = {}
    for scene, camera, index in places:
        code = _code(reader.shard(scene), camera, index, masks)
        if code is not None:
            both = np.stack(masks_of(code)).astype(np.float32)
            total = sums.setdefault(camera, np.zeros_like(both))
            total += resized(both, (total.shape[1], total.shape[2]))
            counts[camera] = counts.get(camera, 0) + 1
        tick()
    return {camera: total / np.float32(counts[camera]) for camera, total in sums.items()}


def _code(shard: Shard, camera: str, index: int, masks: str) -> UInt8Array | None:
    """(h, w) code of a frame's masks; None where they are not valid."""
    group = f"footprints/{masks}"
    if not row(shard, camera, f"{group}/valid", index):
        return None
    drivable, vehicles = (row(shard, camera, f"{group}/{target}", index) for target in TARGETS)
    return code_of(drivable, vehicles)
