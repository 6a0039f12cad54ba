"""A camera's frames some steps apart: looked for among all that were recorded, also those that are left out.

Else, at a high rate, the next frame would step in for one that is not here, and a sequence bridge the gap.
"""

from collections.abc import Sequence

import numpy as np

from ogmkit.base.steps import nearest_rows
from ogmkit.shards.fields import LEFT_OUT_GROUP
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, IntArray


def neighbour_rows(shard: Shard, camera: str, steps: Sequence[int]) -> tuple[IntArray, BoolArray]:
    """Find the frames that are some steps away from each of a camera's frames.

    Args:
        shard: an open shard.
        camera: channel.
        steps: K numbers of steps, negative into the past; a step is that of the shard's settings.

    Returns:
        (N, K) int64 rows, as `nearest_rows` finds them, −1 where none is here; and (N, K) whether the one
        there was is left out.

    Raises:
        ShardError: the shard is damaged.
    """
    times_us, step_s = shard.dataset(camera, "timestamp_us")[:], shard.settings.targets.step_s
    if not shard.left_out(camera):
        rows = nearest_rows(times_us, steps, step_s)
        return rows, np.zeros(rows.shape, np.bool_)
    others_us = shard.dataset(camera, f"{LEFT_OUT_GROUP}/timestamp_us")[:]
    recorded_us = np.concatenate([times_us, others_us])
    order = np.argsort(recorded_us)
    found = nearest_rows(recorded_us[order], steps, step_s)[np.argsort(order)[: len(times_us)]]
    rows = np.where(found >= 0, order[found], -1)
    left_out = rows >= len(times_us)
    return np.where(left_out, -1, rows), left_out
