"""Which frames, or sequences of six, of a folder of shards a dataset is made of."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.samples.requirements import require_extracted, valid_frames
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.folder import ShardFolder
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, IntArray

SEQUENCE = 6
"""Images of a sequence sample, t = −5 … 0 (design.md §3: τ + 1)."""

_Conditions = Mapping[str, BoolArray]
"""What a sample must have → (N,) whether it does, over a camera's frames."""


@dataclass(frozen=True, eq=False)
class FrameIndex:
    """Places of N samples; light, so that it goes to every worker.

    Attributes:
        paths: the shards' files.
        scenes: their scenes' names.
        cameras: channels.
        grid: of all shards.
        image_root: the dataset's root, where shards keep paths of images only; else None.
        shard: (N,) int64 place among `paths`.
        camera: (N,) int64 place among `cameras`.
        frame: (N,) int64 place among the camera's frames; of a sequence, its last one's.
    """

    paths: tuple[Path, ...]
    scenes: tuple[str, ...]
    cameras: tuple[str, ...]
    grid: GridSpec
    image_root: Path | None
    shard: IntArray
    camera: IntArray
    frame: IntArray

    def __len__(self) -> int:
        return len(self.frame)

    def place(self, i: int) -> tuple[str, str, int]:
        """Scene, camera and frame of a sample."""
        return self.scenes[self.shard[i]], self.cameras[self.camera[i]], int(self.frame[i])

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

    def conditions(shard: Shard, camera: str) -> _Conditions:
        valid = valid_frames(shard, camera, needs)
        return valid if valid_only else {}

    return _index(out, scenes, cameras, needs, limit, conditions)


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
    """Find sequences of six consecutive frames of one camera, in the order of scenes, cameras and time.

    Neighbours are no further apart than the longest gap that the shards' trajectories bridge.

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
    max_gap_s = read_manifest(out).settings.targets.max_gap_s

    def conditions(shard: Shard, camera: str) -> _Conditions:
        valid = valid_frames(shard, camera, replace(needs, trajectory=False))
        times_us = shard.dataset(camera, "timestamp_us")[:]
        found = {f"{SEQUENCE - 1} images before it without a gap": _unbroken(times_us, max_gap_s)}
        if whole_trajectory:
            found["a valid trajectory"] = shard.dataset(camera, "trajectory/valid")[:]
        if valid_only:
            found |= {f"{what} in all {SEQUENCE}": _all_of_last(holds) for what, holds in valid.items()}
        return found

    return _index(out, scenes, cameras, needs, limit, conditions)


def _index(
    out: Path,
    scenes: Sequence[str],
    cameras: Sequence[str],
    needs: SampleSpec,
    limit: int | None,
    conditions: Callable[[Shard, str], _Conditions],
) -> FrameIndex:
    if limit is not None and limit < 1:
        raise SettingsError(f"limit: {limit} frames are not a positive number")
    folder = ShardFolder(out)
    manifest = folder.manifest
    require_extracted(out, manifest, needs)
    channels = chosen_cameras(out, manifest, cameras)
    paths = tuple(folder.file(scene) for scene in scenes)
    rows: list[IntArray] = []
    counts: dict[str, int] = {}
    seen = 0
    for number, path in enumerate(paths):
        with Shard(path) as shard:
            for channel, camera in enumerate(channels):
                kept = np.ones(shard.frames(camera), np.bool_)
                seen += len(kept)
                for what, holds in conditions(shard, camera).items():
                    kept &= holds
                    counts[what] = counts.get(what, 0) + int(holds.sum())
                frames = np.flatnonzero(kept)
                rows.append(np.column_stack([np.full_like(frames, n) for n in (number, channel)] + [frames]))
    found = np.concatenate(rows) if rows else np.zeros((0, 3), np.int64)
    if not len(found):
        raise TrainingError(f"{out}: {_nothing_left(seen, counts)}")
    if limit is not None and limit < len(found):
        found = found[np.arange(limit) * len(found) // limit]
    settings = manifest.settings.targets
    image_root = Path(manifest.dataroot) if settings.images == "reference" else None
    return FrameIndex(paths, tuple(scenes), channels, settings.grid, image_root, *found.T.copy())


def _nothing_left(seen: int, counts: Mapping[str, int]) -> str:
    if not counts:
        return f"there are {seen} frames in the chosen scenes; choose others"
    found = ", ".join(f"{count} have {what}" for what, count in counts.items())
    return f"none of {seen} frames can be used ({found})"


def _unbroken(times_us: IntArray, max_gap_s: float) -> BoolArray:
    """(N,) whether a frame ends a run of six without a longer gap between neighbours."""
    joined = np.concatenate([[True], np.diff(times_us) <= max_gap_s * 1e6])
    whole = _all_of_last(joined, SEQUENCE - 1)
    whole[: SEQUENCE - 1] = False
    return whole


def _all_of_last(holds: BoolArray, length: int = SEQUENCE) -> BoolArray:
    """(N,) whether something holds for a frame and those just before it; False where there are too few."""
    result = np.zeros(len(holds), np.bool_)
    if len(holds) >= length:
        result[length - 1 :] = np.lib.stride_tricks.sliding_window_view(holds, length).all(axis=-1)
    return result
