"""Errors of a method's homographies, over any number of frames."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from ogmkit.geometry.se3 import transform_points
from ogmkit.homography.leave_out import LeftOutErrors, RangeSummary, summarise
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class MethodResults:
    """One method's homographies of F frames with M boxes.

    Attributes:
        valid: (F,) whether there is one.
        reason: F strings, why there is none; empty where valid.
        rms_px: (F,) residuals in the image as `Homography` has them; NaN where invalid or without corners.
        rms_cells: (F,) in the BEV.
        left_out: errors of the M boxes.
    """

    valid: BoolArray
    reason: tuple[str, ...]
    rms_px: FloatArray
    rms_cells: FloatArray
    left_out: LeftOutErrors


@dataclass(frozen=True, eq=False)
class MethodSummary:
    """One method over all frames.

    Attributes:
        method: its name.
        results: of all frames, shard by shard and camera by camera.
    """

    method: str
    results: MethodResults

    @property
    def frames(self) -> int:
        """All frames."""
        return len(self.results.valid)

    @property
    def valid(self) -> int:
        """Frames with a homography."""
        return int(self.results.valid.sum())

    @property
    def reasons(self) -> tuple[tuple[str, int], ...]:
        """Why the other frames have none, with their number: the most frequent first."""
        counts = Counter(reason for reason in self.results.reason if reason)
        return tuple(sorted(counts.items(), key=lambda item: (-item[1], item[0])))

    @property
    def median_rms_px(self) -> float:
        """Median over frames with corners; NaN without any."""
        return _median(self.results.rms_px)

    @property
    def median_rms_cells(self) -> float:
        """The same in the BEV."""
        return _median(self.results.rms_cells)

    @property
    def ranges(self) -> tuple[RangeSummary, ...]:
        """Errors of left-out boxes by range."""
        return summarise([self.results.left_out])


def read_results(shard: Shard, camera: str, source: str) -> MethodResults:
    """What a shard says of one homography source.

    Raises:
        ShardError: it has no such source, or the source was not measured with boxes left out.
    """
    group = f"homography/{source}"
    refused = shard.dataset(camera, f"{group}/left_out_refused")[:]
    error_m = shard.dataset(camera, f"{group}/left_out_error_m")[:]
    return MethodResults(
        valid=shard.dataset(camera, f"{group}/valid")[:],
        reason=shard.strings(camera, f"{group}/reason"),
        rms_px=shard.dataset(camera, f"{group}/rms_px")[:],
        rms_cells=shard.dataset(camera, f"{group}/rms_cells")[:],
        left_out=LeftOutErrors(refused | ~np.isnan(error_m), refused, error_m, box_ranges_m(shard, camera)),
    )


def joined(parts: Sequence[MethodResults]) -> MethodResults:
    """The results of all frames of all parts, in their order; at least one part."""
    errors = [part.left_out for part in parts]
    return MethodResults(
        valid=np.concatenate([part.valid for part in parts]),
        reason=tuple(chain.from_iterable(part.reason for part in parts)),
        rms_px=np.concatenate([part.rms_px for part in parts]),
        rms_cells=np.concatenate([part.rms_cells for part in parts]),
        left_out=LeftOutErrors(
            evaluated=np.concatenate([error.evaluated for error in errors]),
            refused=np.concatenate([error.refused for error in errors]),
            error_m=np.concatenate([error.error_m for error in errors]),
            range_m=np.concatenate([error.range_m for error in errors]),
        ),
    )


def box_ranges_m(shard: Shard, camera: str) -> FloatArray:
    """(M,) horizontal distance of each box's centre from its own frame's ego."""
    counts = np.diff(shard.dataset(camera, "boxes/offsets")[:])
    level_from_global = np.repeat(shard.dataset(camera, "level_from_global")[:], counts, axis=0)
    centres = shard.dataset(camera, "boxes/global_from_box")[:, :3, 3]
    places = transform_points(level_from_global, centres[:, None])[:, 0]
    distance: FloatArray = np.hypot(places[:, 0], places[:, 1])
    return distance


def _median(values: FloatArray) -> float:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if len(known) else float("nan")
