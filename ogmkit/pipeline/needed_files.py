"""The files that an extraction needs by the tables: which are there, and which scenes lack some."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from ogmkit.base.files import fault_of, file_status
from ogmkit.errors import TableError
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.paths import resolve
from ogmkit.shards.settings import ExtractSettings

_DIGITS = 16
"""Of a fingerprint: a change is to be noticed, not an attack."""


@dataclass(frozen=True)
class NeededFile:
    """A file that a scene needs.

    Attributes:
        scene: the scene's name.
        channel: of the camera or LiDAR; empty for a map mask.
        name: relative to the dataset's root.
        bytes: its size; −1 where it is absent, 0 where the system refuses to look at it.
    """

    scene: str
    channel: str
    name: str
    bytes: int


def needed_files(
    dataset: Dataset, settings: ExtractSettings, scenes: Sequence[str]
) -> tuple[NeededFile, ...]:
    """All files that the scenes need, in the order of the tables; each is looked at, none is opened."""
    targets = settings.targets
    cameras = () if targets.images == "none" else settings.cameras
    lidars = () if targets.lidar_source is None or not settings.paper else (targets.lidar_source,)
    named = dataset.key_files((*cameras, *lidars), maps=settings.needs_mask)
    chosen = set(scenes)
    return tuple(
        NeededFile(scene, channel, name, _bytes(dataset.root, name))
        for scene, channel, name in named
        if scene in chosen
    )


def extractable(
    files: Sequence[NeededFile], settings: ExtractSettings, scenes: Sequence[str]
) -> tuple[str, ...]:
    """The scenes that will not be left out, as far as it shows without opening files."""
    lost = set(_left_out(files, settings))
    return tuple(scene for scene in scenes if scene not in lost)


def fingerprint(files: Sequence[NeededFile]) -> str:
    """Of which files are there, and of their sizes: it changes when one arrives or is replaced."""
    content = json.dumps([asdict(file) for file in files])
    return hashlib.sha256(content.encode()).hexdigest()[:_DIGITS]


def _left_out(files: Sequence[NeededFile], settings: ExtractSettings) -> Iterator[str]:
    """Scenes that lack a file; where frames are skipped, scenes that have none of a channel."""
    if settings.only_complete:
        yield from (file.scene for file in files if file.bytes < 0)
    elif settings.skip_bad_frames:
        known = {(file.scene, file.channel) for file in files if file.channel}
        there = {(file.scene, file.channel) for file in files if file.bytes >= 0}
        yield from (scene for scene, _ in known - there)


def _bytes(root: Path, name: str) -> int:
    try:
        return file_status(resolve(root, name)).st_size
    except OSError as error:
        return -1 if fault_of(error) == "absent" else 0
    except TableError:
        return -1
