"""Whether the poses and trajectories that sequences are made of are numbers."""

import numpy as np

from ogmkit.errors import ShardError
from ogmkit.samples.index import SEQUENCE, FrameIndex
from ogmkit.shards.reader import H5_ERRORS, REMEDY, Shard, damaged
from ogmkit.typing import BoolArray, IntArray

_POSES = ("global_from_ego", "level_from_global")
_PATHS = ("trajectory/past", "trajectory/future")


def require_finite_poses(index: FrameIndex) -> None:
    """Check the poses of all images of some sequences, and the trajectories of their last ones.

    Args:
        index: as `index_sequences` gives it.

    Raises:
        ShardError: one holds a number that is not finite, or a shard is damaged; names shard, camera and
            frame.
    """
    for number, path in enumerate(index.paths):
        with Shard(path) as shard:
            for channel, camera in enumerate(index.cameras):
                last = index.frame[(index.shard == number) & (index.camera == channel)]
                _require_finite(shard, camera, last)


def _require_finite(shard: Shard, camera: str, last: IntArray) -> None:
    whole = np.unique(last[:, None] - np.arange(SEQUENCE))
    for names, frames, what in ((_POSES, whole, "pose"), (_PATHS, last, "trajectory")):
        for name in names:
            wrong = frames[~_finite(shard, camera, name)[frames]]
            if len(wrong):
                raise ShardError(
                    f"{shard.path}: {camera} frame {wrong[0]}: its {what} ({name}) holds a number that is "
                    f"not finite; {REMEDY}"
                )


def _finite(shard: Shard, camera: str, name: str) -> BoolArray:
    """(N,) whether all numbers of a camera's frames are finite."""
    try:
        values = shard.dataset(camera, name)[:]
        finite: BoolArray = np.isfinite(values).all(axis=tuple(range(1, values.ndim)))
    except H5_ERRORS as error:
        raise damaged(shard.path, error) from error
    return finite
