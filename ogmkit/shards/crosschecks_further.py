"""Whether rasters beside the paper's are what boxes and poses of the shard give."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ogmkit.further_targets import Around, further_targets, instance_numbers
from ogmkit.shards.crosschecks import RASTER_TOLERANCE, first_wrong
from ogmkit.shards.neighbours import neighbour_rows
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_further import INSTANCE_TOKENS, further_fields
from ogmkit.typing import BoolArray, IntArray

_TOLERANCE_M = 1e-3
"""Of offsets and flow, which are stored as float32."""


def further_problems(shard: Shard, camera: str) -> Iterator[str]:
    """Describe what contradicts itself in a camera's further rasters, whose structure is sound.

    All but map layers is made again, frame by frame.

    Yields:
        A line for each contradiction, naming the dataset and the first frame.

    Raises:
        ShardError: the shard is damaged.
    """
    settings = shard.settings.targets
    if not settings.further:
        return
    wrong: defaultdict[str, BoolArray] = defaultdict(lambda: np.zeros(shard.frames(camera), np.bool_))
    boxes = shard.boxes_by_frame(camera)
    numbers = instance_numbers(boxes, settings)
    if settings.instances and shard.strings(camera, INSTANCE_TOKENS.name) != tuple(numbers):
        yield f"/{camera}/{INSTANCE_TOKENS.name} are not the vehicles among the boxes, as they appear"
        return
    following = _following(shard, camera)
    for frame, shown in enumerate(boxes):
        for name in (field.name for field in further_fields(settings)):
            wrong[f"{name} holds other values than 0 and 1"][frame] = (
                _row(shard, camera, name, frame).max() > 1
            )
        around = Around({}, numbers, [None if row < 0 else boxes[row] for row in following[frame]])
        level_from_global = shard.dataset(camera, "level_from_global")[frame]
        made = further_targets(level_from_global, shown, settings, around)
        for name, expected in made.items():
            found = _row(shard, camera, name, frame)
            wrong[f"{name} contradicts boxes or poses"][frame] = _differ(found, expected)
    for problem, where in wrong.items():
        yield from first_wrong(f"/{camera}/{problem} in", where)


def _following(shard: Shard, camera: str) -> IntArray:
    """(N, n) rows of the next key frames, −1 for one that is not there."""
    steps = range(1, shard.settings.targets.following + 1)
    if not steps:
        return np.zeros((shard.frames(camera), 0), np.int64)
    rows, _ = neighbour_rows(shard, camera, steps)
    valid = shard.dataset(camera, "trajectory/future_valid")[:, : len(steps)]
    return np.where(valid, rows, -1)


def _row(shard: Shard, camera: str, name: str, frame: int) -> Any:  # noqa: ANN401  # of several dtypes
    return shard.dataset(camera, name)[frame]


def _differ(found: NDArray[np.generic], expected: NDArray[np.generic]) -> bool:
    """Whether more values differ than rounding explains."""
    same = np.isclose(found, expected, rtol=0, atol=_TOLERANCE_M, equal_nan=True)
    return bool(np.mean(~same) > RASTER_TOLERANCE)
