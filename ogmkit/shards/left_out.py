"""The frames that shards lack, since a file that they need was absent or bad."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from ogmkit.frames import LeftOutFrame
from ogmkit.shards.fields import LEFT_OUT_GROUP
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest
from ogmkit.shards.reader import Shard


@dataclass(frozen=True)
class LeftOutCount:
    """How many frames of a camera are left out for one reason."""

    camera: str
    reason: str
    frames: int


def left_out_frames(shard: Shard, camera: str) -> tuple[LeftOutFrame, ...]:
    """A camera's frames that a shard lacks, in temporal order.

    Raises:
        ShardError: the shard is damaged.
    """
    if not shard.left_out(camera):
        return ()
    tokens, reasons = (
        shard.strings(camera, f"{LEFT_OUT_GROUP}/{name}") for name in ("sample_data_token", "reason")
    )
    times_us = shard.dataset(camera, f"{LEFT_OUT_GROUP}/timestamp_us")[:].tolist()
    return tuple(map(LeftOutFrame, tokens, times_us, reasons))


def count_left_out(shard: Shard) -> tuple[LeftOutCount, ...]:
    """The frames that a shard lacks, counted by camera and reason.

    Raises:
        ShardError: the shard is damaged.
    """
    found = Counter(
        (camera, frame.reason) for camera in shard.cameras for frame in left_out_frames(shard, camera)
    )
    return _counts(found)


def count_left_out_of_all(out: Path, manifest: Manifest) -> tuple[LeftOutCount, ...]:
    """The same over a folder's shards.

    Args:
        out: the folder.
        manifest: its manifest.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    found: Counter[tuple[str, str]] = Counter()
    for entry in manifest.shards:
        with listed_shard(out, entry) as shard:
            for one in count_left_out(shard):
                found[one.camera, one.reason] += one.frames
    return _counts(found)


def _counts(found: Counter[tuple[str, str]]) -> tuple[LeftOutCount, ...]:
    return tuple(LeftOutCount(*key, count) for key, count in sorted(found.items()))
