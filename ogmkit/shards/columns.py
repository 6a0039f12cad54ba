"""The small columns of a shard, gathered from records and targets by the schema's names."""

from collections.abc import Sequence
from itertools import accumulate, chain
from typing import Any

from ogmkit.frames import FrameRecord
from ogmkit.trajectories import Trajectory


def column(
    name: str, frames: Sequence[FrameRecord], trajectories: Sequence[Trajectory], points: Sequence[int]
) -> list[Any]:
    """All rows of one column that is written at once.

    Fields carry the names of the records' attributes, so the name says where its values are.

    Args:
        name: a field's, below the camera's group.
        frames: N records.
        trajectories: N trajectories.
        points: number of LiDAR points of each frame.
    """
    group, _, attribute = name.rpartition("/")
    if attribute == "offsets":
        counts = points if group == "lidar" else [len(frame.boxes) for frame in frames]
        return list(accumulate(counts, initial=0))
    if group == "boxes":
        return list(chain.from_iterable(getattr(frame.boxes, attribute) for frame in frames))
    return [getattr(row, attribute) for row in (trajectories if group == "trajectory" else frames)]
