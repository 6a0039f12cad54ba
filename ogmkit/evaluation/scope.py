"""What an evaluation is about: the frames of a split, and the homographies that all of them have."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.evaluation.frames import Place
from ogmkit.grid import GridSpec
from ogmkit.samples.index import FrameIndex, index_frames
from ogmkit.samples.requirements import require_drivable
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.splits import split_scenes
from ogmkit.shards import schema
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.remedies import homography_command
from ogmkit.typing import IntArray

TRAINING = "train"
"""The split that the mean map and the linear control come from."""
PREFERRED = ("network", "surface")
"""Homographies that masks are warped by unless another is asked for; the first that there is."""


@dataclass(frozen=True, eq=False)
class Scope:
    """The frames to evaluate on.

    Attributes:
        shards: the folder.
        split: the split's name.
        index: its frames.
        training: frames of the split `train`; None where there is none.
        sources: homographies to be compared.
        invalid: homography that all shards of the split have, sorted → frames without a valid one.
        homography: the source that masks are warped by; None where there is no preferred one.
    """

    shards: Path
    split: str
    index: FrameIndex
    training: FrameIndex | None
    sources: tuple[str, ...]
    invalid: Mapping[str, int]
    homography: str | None

    @property
    def grid(self) -> GridSpec:
        """The shards' grid."""
        return self.index.grid

    @property
    def scenes(self) -> tuple[str, ...]:
        """Scenes with frames, in order."""
        return tuple(self.index.scenes[shard] for shard in np.unique(self.index.shard).tolist())


def places(index: FrameIndex) -> Iterator[Place]:
    """Every frame in order."""
    return (index.place(i) for i in range(len(index)))


def paths(index: FrameIndex) -> Mapping[str, Path]:
    """Scene → its shard's file."""
    return dict(zip(index.scenes, index.paths, strict=True))


def scope_of(
    shards: Path,
    *,
    split: str,
    split_file: Path | None,
    cameras: Sequence[str],
    homography: str | None,
    sources: Sequence[str] | None,
    limit: int | None,
) -> Scope:
    """Find the frames and homographies of a split.

    Args:
        shards: a folder that an extraction finished.
        split: the split's name.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        cameras: channels; none means all.
        homography: the source that masks are warped by; None takes the first of `PREFERRED` there is.
        sources: homographies to be compared; None means all that all shards of the split have.
        limit: frames of each split at most, evenly spread.

    Raises:
        SettingsError: the split is unknown or empty, or a camera or a homography isn't there.
        TableError: the split file is absent or malformed.
        ShardError: a shard or the manifest is absent or damaged, or shards don't know the drivable area.
        TrainingError: the split has no frame.
    """
    splits = evaluated_splits(shards, split, split_file)
    require_drivable(shards, read_manifest(shards))
    index = index_frames(shards, splits[split], cameras, needs=SampleSpec(), limit=limit)
    training = None
    if splits.get(TRAINING):
        training = index_frames(shards, splits[TRAINING], cameras, needs=SampleSpec(), limit=limit)
    invalid = invalid_homographies(index)
    for source in (homography, *(sources or ())):
        if source is not None:
            require_homography(shards, split, invalid, source)
    chosen = homography or next((source for source in PREFERRED if source in invalid), None)
    compared = tuple(invalid if sources is None else sources)
    return Scope(shards, split, index, training, compared, invalid, chosen)


def evaluated_splits(shards: Path, split: str, split_file: Path | None) -> Mapping[str, tuple[str, ...]]:
    """All splits' scenes, once it is clear that the one to evaluate on has some.

    Args:
        shards: a folder that an extraction finished.
        split: the split's name.
        split_file: a JSON file of split → scene names instead of the manifest's splits.

    Raises:
        SettingsError: the split is unknown or empty.
        TableError: the split file is absent or malformed.
        ShardError: the manifest is absent or damaged.
    """
    splits = split_scenes(read_manifest(shards), split_file=split_file)
    owner = shards if split_file is None else split_file
    if split not in splits:
        raise SettingsError(f"{owner}: {unknown('split', split, sorted(splits))}")
    if not splits[split]:
        raise SettingsError(f"{owner}: split {split!r} has none of the scenes of {shards}; choose another")
    return splits


def require_homography(shards: Path, split: str, known: Collection[str], source: str) -> None:
    """Refuse a source that not all shards of a split have.

    Raises:
        SettingsError: `source` is not `known`; names the command that makes it.
    """
    if source not in known:
        raise SettingsError(
            f"{shards}: not all shards of split {split!r} have homography {source!r} (all have "
            f"{', '.join(known) or 'none'}); run `{homography_command(shards, source)}`"
        )


def invalid_homographies(index: FrameIndex) -> dict[str, int]:
    """Homography that all shards have, sorted → how many samples lack a valid one, in any of their frames.

    Args:
        index: of the samples.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    counts = [_invalid_of(shard, camera, index.rows[samples]) for shard, camera, samples in index.by_camera()]
    common = set.intersection(*(set(one) for one in counts))
    return {source: sum(one[source] for one in counts) for source in sorted(common)}


def _invalid_of(shard: Shard, camera: str, frames: IntArray) -> dict[str, int]:
    """Homography of a shard's camera → how many of (N, T) frames' rows have an invalid one."""
    counts = {}
    for source in shard.added(camera, schema.HOMOGRAPHY.name):
        valid = shard.dataset(camera, f"{schema.HOMOGRAPHY.name}/{source}/valid")[:]
        counts[source] = int(np.count_nonzero(~valid[frames].all(axis=1)))
    return counts
