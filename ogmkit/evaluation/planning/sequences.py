"""The sequences that planners are evaluated on, and the paths that were driven."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ogmkit.base.steps import STEPS as TRAJECTORY
from ogmkit.errors import ShardError, TrainingError
from ogmkit.evaluation.scope import Reported, reported_scenes
from ogmkit.metrics.plan import STEPS
from ogmkit.samples.index import FrameIndex, index_sequences
from ogmkit.samples.poses import require_finite_poses
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.neighbours import neighbour_rows
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Sequences:
    """N sequences with valid trajectories; positions in metres, in the level frame of the last image.

    Attributes:
        reported: the scenes that they were looked for in.
        index: their places.
        past: (N, 6, 2) at steps −6 … −1.
        future: (N, 6, 2) at steps 1 … 6; the last one is the destination.
    """

    reported: Reported
    index: FrameIndex
    past: FloatArray
    future: FloatArray

    def __len__(self) -> int:
        return len(self.index)

    @property
    def split(self) -> str:
        """The name of their split."""
        return self.reported.split

    @property
    def definition(self) -> str:
        """Of the labels."""
        return self.reported.definition

    @property
    def truth(self) -> FloatArray:
        """(N, 5, 2) what is to be planned."""
        return self.future[:, :STEPS]

    @property
    def destination(self) -> FloatArray:
        """(N, 2) what is given."""
        return self.future[:, STEPS]

    @property
    def scene(self) -> IntArray:
        """(N,) number of each one's scene among those that have sequences."""
        number: IntArray = np.unique(self.index.shard, return_inverse=True)[1].reshape(-1)
        return number

    @property
    def scenes(self) -> int:
        """Scenes that have sequences."""
        return len(self.scene_names)

    @property
    def scene_names(self) -> tuple[str, ...]:
        """Their names, in order."""
        return tuple(self.index.scenes[shard] for shard in np.unique(self.index.shard).tolist())


def sequences_of(
    shards: Path, *, split: str | None, split_file: Path | None, cameras: Sequence[str], limit: int | None
) -> Sequences:
    """Find the sequences of a split and read their paths.

    Args:
        shards: a folder that an extraction finished.
        split: the split's name; None for what `divide_scenes` leaves to report.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        cameras: channels; none means all.
        limit: sequences at most, evenly spread.

    Raises:
        SettingsError: the split is unknown or empty, or a camera isn't there.
        TableError: the split file is absent or malformed.
        ShardError: a shard or the manifest is absent or damaged, or a position or pose is not finite.
        TrainingError: the split has no sequence.
    """
    reported = reported_scenes(shards, split, split_file)
    return _sequences(shards, reported, cameras, limit)


def training_sequences(shards: Path, evaluated: Sequences, *, limit: int | None) -> Sequences | None:
    """The sequences of the scenes to learn from, but for those that are evaluated.

    Args:
        shards: a folder that an extraction finished.
        evaluated: the sequences to evaluate on; their cameras are taken.
        limit: sequences at most, evenly spread.

    Returns:
        None where there are none.

    Raises:
        TableError, ShardError: as `sequences_of`.
    """
    reported = evaluated.reported
    unseen = tuple(scene for scene in reported.training if scene not in reported.scenes)
    if not unseen:
        return None
    try:
        return _sequences(shards, replace(reported, scenes=unseen), evaluated.index.cameras, limit)
    except TrainingError:
        return None


def _sequences(shards: Path, reported: Reported, cameras: Sequence[str], limit: int | None) -> Sequences:
    """The sequences of some scenes, and their paths."""
    needs = SampleSpec(trajectory=True)
    index = index_sequences(shards, reported.scenes, cameras, needs=needs, valid_only=False, limit=limit)
    require_finite_poses(index)
    past, future = np.empty((2, len(index), TRAJECTORY, 2))
    for shard, camera, samples in index.by_camera():
        past[samples], future[samples] = _paths(shard, camera, index.frame[samples])
    return Sequences(reported, index, past, future)


def planned_rows(shard: Shard, camera: str) -> tuple[IntArray, BoolArray]:
    """(N, 5) places of the frames at points 1 … 5, and (N, 5) which are left out, as of `neighbour_rows`."""
    return neighbour_rows(shard, camera, range(1, STEPS + 1))


def _paths(shard: Shard, camera: str, frames: IntArray) -> tuple[FloatArray, FloatArray]:
    """Past and future of sequences by their last frames, which are followed by those that are planned."""
    past, future = (shard.dataset(camera, f"trajectory/{name}")[:] for name in ("past", "future"))
    later, left_out = planned_rows(shard, camera)
    late = frames[((later < 0) & ~left_out)[frames].any(axis=1)]
    if len(late):
        raise ShardError(
            f"{shard.path}: {camera}: frame {late[0]} has a valid trajectory, but too few frames follow; "
            f"{REMEDY}"
        )
    return past[frames], future[frames]
