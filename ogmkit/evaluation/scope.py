"""What an evaluation is about: the frames of a split, and the homographies that all of them have."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.evaluation.frames import Place
from ogmkit.evaluation.result import definition_of
from ogmkit.grid import GridSpec
from ogmkit.homography.sources import sources_of
from ogmkit.samples.index import FrameIndex, index_frames
from ogmkit.samples.requirements import require_drivable
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.splits import TEST, divide_scenes, split_scenes
from ogmkit.shards import schema
from ogmkit.shards.crosschecks_added import origin_problem
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.remedies import footprints_command, homography_command
from ogmkit.typing import IntArray

PREFERRED = ("network", "surface")
"""Homographies that masks are warped by unless another is asked for; the first that there is."""


@dataclass(frozen=True, eq=False)
class Scope:
    """The frames to evaluate on.

    Attributes:
        shards: the folder.
        split: the split's name.
        note: how that differs from the shards' split of this name; empty where it doesn't.
        index: its frames.
        training: frames of the scenes to learn from; None where there is none.
        sources: homographies to be compared.
        invalid: homography that all shards of the split have, sorted → frames without a valid one.
        homography: the source that masks are warped by, or one for each mask; None where there is no
            preferred one.
        definition: of the labels.
        seen: kinds of cells that the shards have beside the field of view.
    """

    shards: Path
    split: str
    note: str
    index: FrameIndex
    training: FrameIndex | None
    sources: tuple[str, ...]
    invalid: Mapping[str, int]
    homography: str | None
    definition: str
    seen: tuple[str, ...] = ()

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


@dataclass(frozen=True)
class Reported:
    """The scenes that an evaluation is about.

    Attributes:
        split: the name of what they are for.
        scenes: their names.
        training: names of the scenes to learn from.
        note: how that differs from the shards' splits of these names; empty where it doesn't.
        definition: of the shards' labels.
    """

    split: str
    scenes: tuple[str, ...]
    training: tuple[str, ...]
    note: str
    definition: str


def scope_of(
    shards: Path,
    *,
    split: str | None,
    split_file: Path | None,
    cameras: Sequence[str],
    homography: str | None,
    sources: Sequence[str] | None,
    limit: int | None,
) -> Scope:
    """Find the frames and homographies of a split.

    Args:
        shards: a folder that an extraction finished.
        split: the split's name; None for what `divide_scenes` leaves to report.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        cameras: channels; none means all.
        homography: the source that masks are warped by, or one for the drivable area and one for the
            vehicles; None takes the first of `PREFERRED` there is.
        sources: homographies to be compared; None means all that all shards of the split have.
        limit: frames of each split at most, evenly spread.

    Raises:
        SettingsError: the split is unknown or empty, or a camera or a homography isn't there.
        TableError: the split file is absent or malformed.
        ShardError: a shard or the manifest is absent or damaged, or shards don't know the drivable area.
        TrainingError: the split has no frame.
    """
    reported = reported_scenes(shards, split, split_file)
    manifest = read_manifest(shards)
    require_drivable(shards, manifest)
    index = index_frames(shards, reported.scenes, cameras, needs=SampleSpec(), limit=limit)
    training = None
    if reported.training:
        training = index_frames(shards, reported.training, cameras, needs=SampleSpec(), limit=limit)
    invalid = invalid_homographies(index)
    for source in (*each_source(homography), *(sources or ())):
        require_homography(shards, reported.split, invalid, source)
    chosen = homography or next((source for source in PREFERRED if source in invalid), None)
    compared = tuple(invalid if sources is None else sources)
    return Scope(
        shards,
        reported.split,
        reported.note,
        index,
        training,
        compared,
        invalid,
        chosen,
        reported.definition,
        manifest.settings.targets.seen[1:],
    )


def reported_scenes(shards: Path, split: str | None, split_file: Path | None) -> Reported:
    """The scenes to evaluate on.

    Args:
        shards: a folder that an extraction finished.
        split: the split's name; None for what `divide_scenes` leaves to report.
        split_file: a JSON file of split → scene names instead of the manifest's splits.

    Raises:
        SettingsError: the split is unknown or empty.
        TableError: the split file is absent or malformed.
        ShardError: the manifest, or a shard that is looked at for its boxes or log, is absent or damaged.
    """
    manifest = read_manifest(shards)
    division = divide_scenes(shards, manifest, split_file=split_file)
    splits = split_scenes(manifest, split_file=split_file)
    if division.test and (split is None or TEST not in splits):
        splits[TEST] = division.test
    chosen, owner = split or division.reported, split_file or shards
    if chosen not in splits:
        raise SettingsError(f"{owner}: {unknown('split', chosen, sorted(splits))}")
    if not splits[chosen]:
        raise SettingsError(f"{owner}: split {chosen!r} has none of the scenes of {shards}; choose another")
    note = division.note if splits[chosen] == division.test else ""
    definition = definition_of(manifest.settings.targets)
    return Reported(chosen, splits[chosen], division.train, note, definition)


def each_source(homography: str | None) -> tuple[str, ...]:
    """The sources that masks are warped by, each once; none without a homography."""
    return () if homography is None else tuple(dict.fromkeys(sources_of(homography)))


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


def masks_problem(shards: Path, index: FrameIndex, name: str) -> str:
    """Why a set of camera-view masks can't serve as truth; empty where it can.

    Args:
        shards: the folder, for messages.
        index: of the frames.
        name: of the set.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    for path in index.paths:
        with Shard(path) as shard:
            for camera in index.cameras:
                if name not in shard.added(camera, schema.FOOTPRINTS.name):
                    command = footprints_command(shards, name)
                    return f"{path.name}: {camera} has no footprints {name!r}: run `{command}`"
                problem = origin_problem(shard, camera, name)
                if problem:
                    return f"{path.name}: {camera}/footprints/{name} {problem}"
    return ""


def _invalid_of(shard: Shard, camera: str, frames: IntArray) -> dict[str, int]:
    """Homography of a shard's camera → how many of (N, T) frames' rows have an invalid one."""
    counts = {}
    for source in shard.added(camera, schema.HOMOGRAPHY.name):
        valid = shard.dataset(camera, f"{schema.HOMOGRAPHY.name}/{source}/valid")[:]
        counts[source] = int(np.count_nonzero(~valid[frames].all(axis=1)))
    return counts
