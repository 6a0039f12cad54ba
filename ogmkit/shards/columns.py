"""The small columns of a shard, gathered from records and targets by the schema's names."""

from collections.abc import Mapping, Sequence
from itertools import accumulate, chain
from typing import Any

from ogmkit.frames import FrameRecord, LeftOutFrame
from ogmkit.shards.fields import LEFT_OUT_GROUP
from ogmkit.shards.schema_seen import SEEN
from ogmkit.trajectories import Trajectory


def column(
    name: str,
    frames: Sequence[FrameRecord],
    left_out: Sequence[LeftOutFrame],
    trajectories: Sequence[Trajectory],
    points: Sequence[int],
) -> list[Any]:
    """All rows of one column that is written at once.

    Fields carry the names of the records' attributes, so the name says where its values are.

    Args:
        name: a field's, below the camera's group.
        frames: N records.
        left_out: L frames that are not among them.
        trajectories: N trajectories.
        points: number of LiDAR points of each frame.
    """
    group, _, attribute = name.rpartition("/")
    if attribute == "offsets":
        counts = points if group == "lidar" else [len(frame.boxes) for frame in frames]
        return list(accumulate(counts, initial=0))
    if group == "boxes":
        return list(chain.from_iterable(getattr(frame.boxes, attribute) for frame in frames))
    rows: Mapping[str, Sequence[Any]] = {
        "trajectory": trajectories,
        LEFT_OUT_GROUP: left_out,
        SEEN: frames,
        "": frames,
    }
    return [getattr(row, attribute) for row in rows[group]]
