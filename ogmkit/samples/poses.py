"""Whether the poses and trajectories that sequences are made of are numbers."""

import numpy as np

from ogmkit.errors import ShardError
from ogmkit.samples.index import FrameIndex
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, IntArray

_POSES = ("global_from_ego", "level_from_global")
_PATHS = ("trajectory/past", "trajectory/future")


def require_finite_poses(index: FrameIndex) -> None:
    """Check the poses of all images of some sequences, and the last ones' trajectories that are called valid.

    Args:
        index: as `index_sequences` gives it.

    Raises:
        ShardError: one holds a number that is not finite, or a shard is damaged; names shard, camera and
            frame.
    """
    for shard, camera, samples in index.by_camera():
        _require_finite(shard, camera, index.rows[samples])


def _require_finite(shard: Shard, camera: str, rows: IntArray) -> None:
    whole, last = np.unique(rows), rows[:, -1]
    claimed = last[shard.dataset(camera, "trajectory/valid")[:][last]]
    for names, frames, what in ((_POSES, whole, "pose"), (_PATHS, claimed, "trajectory")):
        for name in names:
            wrong = frames[~_finite(shard, camera, name)[frames]]
            if len(wrong):
                raise ShardError(
                    f"{shard.path}: {camera} frame {wrong[0]}: its {what} ({name}) holds a number that is "
                    f"not finite; {REMEDY}"
                )


def _finite(shard: Shard, camera: str, name: str) -> BoolArray:
    """(N,) whether all numbers of a camera's frames are finite."""
    values = shard.dataset(camera, name)[:]
    finite: BoolArray = np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
    return finite
