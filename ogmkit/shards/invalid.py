"""Frames of a shard that lack a valid trajectory, homography or set of masks, and why."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path

from ogmkit.shards import schema
from ogmkit.shards.faults import H5_ERRORS, damaged
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest
from ogmkit.shards.reader import Shard

_TRAJECTORY = "trajectory"
_Reasons = dict[int, str]
"""Frame → why it is invalid."""


@dataclass(frozen=True)
class InvalidFrames:
    """Frames of one scene and camera that lack one thing for one reason.

    Attributes:
        scene: the scene's name.
        camera: channel.
        of: what is invalid: `trajectory`, or a group such as `homography/surface`.
        reason: why, in words.
        frames: their places among the camera's frames, from 0.
    """

    scene: str
    camera: str
    of: str
    reason: str
    frames: tuple[int, ...]


@dataclass(frozen=True)
class InvalidCount:
    """How many frames lack one thing for one reason; attributes as of `InvalidFrames`.

    Attributes:
        frames: how many, over all scenes.
    """

    camera: str
    of: str
    reason: str
    frames: int


def invalid_frames(shard: Shard) -> tuple[InvalidFrames, ...]:
    """All invalid frames of a shard, by camera and by what is invalid.

    Raises:
        ShardError: the shard is damaged.
    """
    try:
        return tuple(
            InvalidFrames(shard.scene, camera, of, reason, tuple(frame for _, frame in places))
            for camera in shard.cameras
            for of, reasons in _parts(shard, camera)
            for reason, places in groupby(
                sorted((reason, frame) for frame, reason in reasons.items()), key=itemgetter(0)
            )
        )
    except H5_ERRORS as error:
        raise damaged(shard.path, error) from error


def count_invalid(out: Path, manifest: Manifest) -> tuple[InvalidCount, ...]:
    """The invalid frames of a folder of shards, counted over its scenes.

    Args:
        out: the folder.
        manifest: its manifest.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    counts: dict[tuple[str, str, str], int] = {}
    for entry in manifest.shards:
        with listed_shard(out, entry) as shard:
            for found in invalid_frames(shard):
                key = found.camera, found.of, found.reason
                counts[key] = counts.get(key, 0) + len(found.frames)
    return tuple(InvalidCount(*key, count) for key, count in sorted(counts.items()))


def _parts(shard: Shard, camera: str) -> Iterator[tuple[str, _Reasons]]:
    """What a camera's frames may lack."""
    yield _TRAJECTORY, _trajectory(shard, camera)
    for name in shard.added(camera, schema.HOMOGRAPHY.name):
        group = f"{schema.HOMOGRAPHY.name}/{name}"
        reasons = shard.strings(camera, f"{group}/reason")
        yield group, {frame: reasons[frame] for frame in _invalid(shard, camera, group)}
    for name in shard.added(camera, schema.FOOTPRINTS.name):
        group = f"{schema.FOOTPRINTS.name}/{name}"
        source = shard.attributes(f"{camera}/{group}").get("homography", "")
        yield group, dict.fromkeys(_invalid(shard, camera, group), f"no valid homography {source}")


def _invalid(shard: Shard, camera: str, group: str) -> Sequence[int]:
    valid = shard.dataset(camera, f"{group}/valid")[:]
    return [frame for frame, holds in enumerate(valid) if not holds]


def _trajectory(shard: Shard, camera: str) -> _Reasons:
    there = [
        (name, shard.dataset(camera, f"{_TRAJECTORY}/{name}_valid")[:].all(axis=1))
        for name in ("past", "future")
    ]
    return {
        frame: f"{' and '.join(name for name, holds in there if not holds[frame])} positions are missing"
        for frame in _invalid(shard, camera, _TRAJECTORY)
    }
