"""Which frames, or sequences of six, of a folder of shards a dataset is made of."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.base.steps import joined
from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.samples.requirements import require_extracted, valid_frames
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.folder import ShardFolder
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.neighbours import neighbour_rows
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, IntArray

SEQUENCE = 6
"""Images of a sequence sample, t = −5 … 0 (design.md §3: τ + 1)."""

_AGO = range(1 - SEQUENCE, 1)
"""Their steps."""


@dataclass(frozen=True, eq=False)
class _Candidates:
    """Samples that a camera's frames would make.

    Attributes:
        rows: (N, T) int64 frames of each, the last being the frame itself.
        conditions: what a sample must have → (N,) whether it does.
    """

    rows: IntArray
    conditions: Mapping[str, BoolArray]


@dataclass(frozen=True, eq=False)
class FrameIndex:
    """Places of N samples; light, so that it goes to every worker.

    Attributes:
        paths: the shards' files.
        scenes: their scenes' names.
        cameras: channels.
        grid: of all shards.
        step_s: time from one image of a sequence, and one point of a trajectory, to the next.
        image_root: the dataset's root, where shards keep paths of images only; else None.
        shard: (N,) int64 place among `paths`.
        camera: (N,) int64 place among `cameras`.
        rows: (N, T) int64 places among the camera's frames, oldest first; T = 1, or 6 for sequences.
    """

    paths: tuple[Path, ...]
    scenes: tuple[str, ...]
    cameras: tuple[str, ...]
    grid: GridSpec
    step_s: float
    image_root: Path | None
    shard: IntArray
    camera: IntArray
    rows: IntArray

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def frame(self) -> IntArray:
        """(N,) place among the camera's frames; of a sequence, its last one's."""
        last: IntArray = self.rows[:, -1]
        return last

    def place(self, i: int) -> tuple[str, str, int]:
        """Scene, camera and frame of a sample."""
        return self.scenes[self.shard[i]], self.cameras[self.camera[i]], int(self.frame[i])

    def single_frames(self) -> tuple["FrameIndex", IntArray]:
        """The frames that the samples are made of, each once, and (N, T) the place of each sample's there."""
        frames = np.stack(np.broadcast_arrays(self.shard[:, None], self.camera[:, None], self.rows), -1)
        unique, place = np.unique(frames.reshape(-1, 3), axis=0, return_inverse=True)
        single = replace(self, shard=unique[:, 0], camera=unique[:, 1], rows=unique[:, 2:])
        return single, place.reshape(self.rows.shape)

    def by_scene(self) -> Iterator["FrameIndex"]:
        """The samples of each scene that has any, in the same order, by themselves."""
        starts = np.flatnonzero(np.diff(self.shard, prepend=-1)).tolist()
        for start, stop in pairwise((*starts, len(self))):
            number = self.shard[start]
            yield replace(
                self,
                paths=(self.paths[number],),
                scenes=(self.scenes[number],),
                shard=np.zeros(stop - start, np.int64),
                camera=self.camera[start:stop],
                rows=self.rows[start:stop],
            )

    def by_camera(self) -> Iterator[tuple[Shard, str, IntArray]]:
        """Each shard, open, with each of its cameras and the places in the index of that one's samples.

        Raises:
            ShardError: a shard is absent or damaged.
        """
        for number, path in enumerate(self.paths):
            with Shard(path) as shard:
                for channel, camera in enumerate(self.cameras):
                    yield shard, camera, np.flatnonzero((self.shard == number) & (self.camera == channel))

    def counted(self, sample: str) -> str:
        """The samples, each called so, with scenes and cameras: `40 frames of 2 scenes, CAM_FRONT`."""
        scenes = with_number(len(np.unique(self.shard)), "scene")
        return f"{with_number(len(self), sample)} of {scenes}, {', '.join(self.cameras)}"


def index_frames(
    out: Path,
    scenes: Sequence[str],
    cameras: Sequence[str],
    *,
    needs: SampleSpec,
    limit: int | None = None,
    valid_only: bool = True,
) -> FrameIndex:
    """Find the frames of some scenes, in the order of scenes, cameras and time.

    Args:
        out: a folder that `ogmkit extract` wrote.
        scenes: names.
        cameras: channels; none stands for all of the folder's.
        needs: what samples will hold.
        limit: most frames to take, evenly spread; None takes all.
        valid_only: leave out frames without a valid homography, valid masks or valid trajectory, where
            `needs` asks for them.

    Raises:
        SettingsError: the folder has no such scene or camera, or the limit is not positive.
        ShardError: a shard lacks something that is needed (the text names the command that makes it), or is
            damaged.
        TrainingError: no frame is left.
    """

    def candidates(shard: Shard, camera: str) -> _Candidates:
        valid = valid_frames(shard, camera, needs)
        return _Candidates(np.arange(shard.frames(camera))[:, None], valid if valid_only else {})

    return _index(out, scenes, cameras, needs, limit, candidates)


def index_sequences(
    out: Path,
    scenes: Sequence[str],
    cameras: Sequence[str],
    *,
    needs: SampleSpec,
    limit: int | None = None,
    valid_only: bool = True,
    whole_trajectory: bool = True,
) -> FrameIndex:
    """Find sequences of six frames of one camera, a step apart, in the order of scenes, cameras and time.

    Step and longest gap are those of the shards' trajectories: between two images of a sequence there may be
    others.

    Args:
        out: a folder that `ogmkit extract` wrote.
        scenes: names.
        cameras: channels; none stands for all of the folder's.
        needs: what samples will hold.
        limit: most sequences to take, evenly spread; None takes all.
        valid_only: leave out sequences where one of the six has no valid homography or masks that `needs`
            asks for.
        whole_trajectory: leave out sequences whose last frame lacks a point of its past or future. False
            keeps them: missing points are NaN and `trajectory_valid` is False.

    Raises:
        SettingsError, ShardError, TrainingError: as `index_frames`.
    """
    targets = read_manifest(out).settings.targets

    def candidates(shard: Shard, camera: str) -> _Candidates:
        valid = valid_frames(shard, camera, replace(needs, trajectory=False))
        times_us = shard.dataset(camera, "timestamp_us")[:]
        rows, _ = neighbour_rows(shard, camera, _AGO)
        there = rows >= 0
        leads_on = joined(np.where(there, times_us[rows], -1), targets.gap_s)
        unbroken = np.logical_and.reduce(leads_on, axis=1)
        found = {f"{SEQUENCE - 1} images before it without a gap": unbroken}
        if whole_trajectory:
            found["a valid trajectory"] = shard.dataset(camera, "trajectory/valid")[:]
        if valid_only:
            for what, holds in valid.items():
                found[f"{what} in all {SEQUENCE}"] = np.logical_and.reduce(there & holds[rows], axis=1)
        return _Candidates(rows, found)

    return _index(out, scenes, cameras, needs, limit, candidates)


def _index(
    out: Path,
    scenes: Sequence[str],
    cameras: Sequence[str],
    needs: SampleSpec,
    limit: int | None,
    candidates: Callable[[Shard, str], _Candidates],
) -> FrameIndex:
    if limit is not None and limit < 1:
        raise SettingsError(f"limit: {limit} frames are not a positive number")
    folder = ShardFolder(out)
    manifest = folder.manifest
    require_extracted(out, manifest, needs)
    channels = chosen_cameras(out, manifest, cameras)
    paths = tuple(folder.file(scene) for scene in scenes)
    found: list[tuple[int, int, IntArray]] = []
    counts: dict[str, int] = {}
    seen = 0
    for number, scene in enumerate(scenes):
        with folder.shard(scene) as shard:
            for channel, camera in enumerate(channels):
                all_of_it = candidates(shard, camera)
                kept = np.ones(len(all_of_it.rows), np.bool_)
                seen += len(kept)
                for what, holds in all_of_it.conditions.items():
                    kept &= holds
                    counts[what] = counts.get(what, 0) + int(holds.sum())
                found.append((number, channel, all_of_it.rows[kept]))
    if not any(len(rows) for *_, rows in found):
        raise TrainingError(f"{out}: {_nothing_left(seen, counts)}")
    lengths = [len(rows) for *_, rows in found]
    columns = [np.repeat([one[place] for one in found], lengths) for place in (0, 1)]
    columns.append(np.concatenate([rows for *_, rows in found]))
    if limit is not None and limit < sum(lengths):
        columns = [column[np.arange(limit) * len(column) // limit] for column in columns]
    settings = manifest.settings.targets
    image_root = Path(manifest.dataroot) if settings.images == "reference" else None
    return FrameIndex(paths, tuple(scenes), channels, settings.grid, settings.step_s, image_root, *columns)


def _nothing_left(seen: int, counts: Mapping[str, int]) -> str:
    if not counts:
        return f"there are {seen} frames in the chosen scenes; choose others"
    found = ", ".join(f"{count} have {what}" for what, count in counts.items())
    return f"none of {seen} frames can be used ({found})"
