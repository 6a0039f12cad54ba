"""Which key frames samples round the vehicle are made of: those that all cameras saw."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.errors import ShardError, TrainingError
from ogmkit.labels.definition import Definition
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.samples.requirements import again, require_extracted
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.surround_spec import SurroundSpec, labels_for
from ogmkit.shards import schema_labels
from ogmkit.shards.folder import ShardFolder
from ogmkit.shards.reader import Shard
from ogmkit.typing import IntArray

RIG = ("CAM_FRONT_LEFT", "CAM_FRONT", "CAM_FRONT_RIGHT", "CAM_BACK_LEFT", "CAM_BACK", "CAM_BACK_RIGHT")
"""The order that those repositories have nuScenes' cameras in; others come after them, sorted."""


@dataclass(frozen=True, eq=False)
class SurroundIndex:
    """Places of N samples of C cameras; light, so that it goes to every worker.

    Attributes:
        paths: the shards' files.
        scenes: their scenes' names.
        cameras: channels, in the order of a sample's images.
        definition: whose labels.
        image_root: the dataset's root, where shards keep paths of images only; else None.
        shard: (N,) int64 place among `paths`.
        row: (N,) int64 place among the samples of the shard's labels.
        frames: (N, C) int64 places among the frames of each camera.
    """

    paths: tuple[Path, ...]
    scenes: tuple[str, ...]
    cameras: tuple[str, ...]
    definition: Definition
    image_root: Path | None
    shard: IntArray
    row: IntArray
    frames: IntArray

    def __len__(self) -> int:
        return len(self.row)


def index_surround(
    out: Path, scenes: Sequence[str], cameras: Sequence[str] = (), *, needs: SurroundSpec
) -> SurroundIndex:
    """Find the key frames of some scenes, in the order of scenes and time, that all cameras have.

    Args:
        out: a folder that `ogmkit extract` wrote.
        scenes: names.
        cameras: channels, in the order of a sample's images; none stands for all of the folder's.
        needs: what samples will hold.

    Raises:
        SettingsError: the folder has no such scene or camera, or not these labels.
        ShardError: a shard lacks something that is needed (the text names the command that makes it), or is
            damaged.
        TrainingError: no key frame is left.
    """
    folder = ShardFolder(out)
    manifest = folder.manifest
    definition = labels_for(folder, needs)
    require_extracted(out, manifest, SampleSpec(image_size=needs.image_size))
    channels = chosen_cameras(out, manifest, cameras)
    if not cameras:
        channels = tuple(
            sorted(channels, key=lambda name: (RIG.index(name) if name in RIG else len(RIG), name))
        )
    found: list[IntArray] = []
    for number, scene in enumerate(scenes):
        with folder.shard(scene) as shard:
            require_poses(shard, again(out, manifest))
            rows = _rows(shard, channels)
        found.append(np.column_stack([np.full(len(rows), number), rows]))
    columns = np.concatenate(found) if found else np.zeros((0, 2 + len(channels)), np.int64)
    if not len(columns):
        raise TrainingError(f"{out}: no key frame is among the frames of all of {', '.join(channels)}")
    paths = tuple(folder.file(scene) for scene in scenes)
    by_path = manifest.settings.targets.images == "reference"
    image_root = Path(manifest.dataroot) if by_path else None
    return SurroundIndex(
        paths, tuple(scenes), channels, definition, image_root, columns[:, 0], columns[:, 1], columns[:, 2:]
    )


def require_poses(shard: Shard, command: str) -> None:
    """Check that a shard knows where the vehicle was at the time of its sweeps.

    Raises:
        ShardError: it was made before that was kept; names the command that makes it again.
    """
    for field in schema_labels.POSES:
        if field.name not in shard.h5[schema_labels.SURROUND]:
            raise ShardError(
                f"{shard.path}: has no {schema_labels.SURROUND}/{field.name}, being of an earlier version; "
                f"run `{command}`"
            )


def frames_by_row(shard: Shard, cameras: Sequence[str]) -> tuple[dict[str, int], ...]:
    """Of each sample of the labels, camera → its frame's place among the camera's, where there is one."""
    token = schema_labels.SAMPLE_TOKENS.name
    frame_of = {
        camera: {name: frame for frame, name in enumerate(shard.strings(camera, token))} for camera in cameras
    }
    return tuple(
        {camera: frames[name] for camera, frames in frame_of.items() if name in frames}
        for name in shard.strings(schema_labels.SURROUND, token)
    )


def _rows(shard: Shard, cameras: Sequence[str]) -> IntArray:
    """(N, 1 + C): sample of the labels, and the frame of each camera."""
    rows = [
        [row, *frames.values()]
        for row, frames in enumerate(frames_by_row(shard, cameras))
        if len(frames) == len(cameras)
    ]
    return np.array(rows, dtype=np.int64).reshape(-1, 1 + len(cameras))
