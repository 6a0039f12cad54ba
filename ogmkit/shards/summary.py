"""A shard in figures, and whether it is what an extraction would write."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.errors import ShardError, UnreadableShardError
from ogmkit.frames import FrameRecord, LeftOutFrame, SceneRecord
from ogmkit.shards.faults import H5_ERRORS
from ogmkit.shards.labels_rows import sample_tokens
from ogmkit.shards.left_out import left_out_frames
from ogmkit.shards.manifest import file_sha256
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_labels import SAMPLE_TOKENS
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.structure import structure_problems


@dataclass(frozen=True)
class ShardSummary:
    """One shard.

    Attributes:
        scene: the scene's name.
        location: the map's name.
        frames: frames over all cameras; without any, samples of its labels.
        valid_trajectories: frames with a valid trajectory.
        left_out: frames that are not here since a file was absent or bad.
        drivable_share: share of drivable cells, over all frames; NaN where the shard doesn't know them.
        vehicle_share: share of vehicle cells, over all frames.
        blind: cameras that see no cell of the grid in any frame.
        step_s: median, shortest and longest time of a step; of several cameras' medians the median. NaN where
            the shard doesn't say.
        bytes: the file's size.
        sha256: the file's checksum, hexadecimal.
    """

    scene: str
    location: str
    frames: int
    valid_trajectories: int
    left_out: int
    drivable_share: float
    vehicle_share: float
    blind: tuple[str, ...]
    step_s: tuple[float, float, float]
    bytes: int
    sha256: str


def summarise(path: Path, *, sha256: str | None = None) -> ShardSummary:
    """The figures of a whole shard.

    Args:
        path: the shard's file.
        sha256: its checksum, where that is known; otherwise the file is read for it.

    Raises:
        ShardError: the file is not a whole shard.
    """
    with Shard(path) as shard:
        cameras = [(shard.frames(camera), shard.attributes(camera)) for camera in shard.cameras]
        return ShardSummary(
            scene=shard.scene,
            location=shard.location,
            frames=shard.rows,
            valid_trajectories=sum(int(attributes["valid_trajectories"]) for _, attributes in cameras),
            left_out=sum(map(shard.left_out, shard.cameras)),
            drivable_share=_share("drivable_share", cameras),
            vehicle_share=_share("vehicle_share", cameras),
            blind=tuple(
                str(attributes["channel"])
                for _, attributes in cameras
                if attributes.get("field_of_view_share") == 0
            ),
            step_s=spread([_step(attributes) for _, attributes in cameras]),
            bytes=path.stat().st_size,
            sha256=sha256 or file_sha256(path),
        )


def spread(steps_s: Sequence[tuple[float, float, float]]) -> tuple[float, float, float]:
    """The median of medians, the shortest and the longest of some; NaN without any, or where one is."""
    if not steps_s:
        return np.nan, np.nan, np.nan
    medians, shortest, longest = np.array(steps_s).T
    return float(np.median(medians)), float(shortest.min()), float(longest.max())


def _tokens(frames: Sequence[FrameRecord | LeftOutFrame]) -> tuple[str, ...]:
    return tuple(frame.sample_data_token for frame in frames)


def _share(name: str, cameras: Sequence[tuple[int, Mapping[str, Any]]]) -> float:
    """Over the frames of all cameras; NaN where one doesn't say, or there is none."""
    frames = sum(count for count, _ in cameras)
    if not cameras:
        return np.nan
    return sum(count * float(attributes.get(name, np.nan)) for count, attributes in cameras) / frames


def _step(attributes: Mapping[str, Any]) -> tuple[float, float, float]:
    typical, shortest, longest = (
        float(attributes.get(name, np.nan)) for name in ("step_s", "step_min_s", "step_max_s")
    )
    return typical, shortest, longest


@dataclass(frozen=True)
class Expected:
    """What a scene's shard holds, by tokens.

    Attributes:
        scene: the scene's name.
        frames: camera → `sample_data` tokens, in temporal order.
        left_out: the same of frames that are left out; cameras without any may be absent.
        samples: place of labels → tokens of the samples that are their rows.
    """

    scene: str
    frames: Mapping[str, tuple[str, ...]]
    left_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    samples: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: SceneRecord, settings: ExtractSettings) -> "Expected":
        """Of a scene's records."""
        frames = {camera: _tokens(some) for camera, some in scene.cameras.items()}
        left_out = {camera: _tokens(some) for camera, some in scene.left_out.items()}
        samples: dict[str, tuple[str, ...]] = {
            one.place: sample_tokens(scene, one) for one in settings.labels
        }
        return cls(scene.name, frames, left_out, samples)


def is_current(
    path: Path, expected: Expected, settings: ExtractSettings, dataset_version: str, *, whole: bool = False
) -> bool:
    """Whether `path` is a whole shard of this very content with these settings.

    Args:
        path: the file.
        expected: the content.
        settings: how it was extracted.
        dataset_version: the source's tables.
        whole: whether the file is known to be whole; else all that the schema asks for is looked for.

    Raises:
        UnreadableShardError: the system refuses to read it.
    """
    try:
        with Shard(path) as shard:
            return (
                (shard.scene, shard.dataset_version) == (expected.scene, dataset_version)
                and shard.settings.to_dict() == settings.to_dict()
                and (whole or not any(structure_problems(shard)))
                and all(
                    shard.strings(camera, "sample_data_token") == tokens
                    and _tokens(left_out_frames(shard, camera)) == expected.left_out.get(camera, ())
                    for camera, tokens in expected.frames.items()
                )
                and all(
                    shard.strings(place, SAMPLE_TOKENS.name) == tokens
                    for place, tokens in expected.samples.items()
                )
            )
    except UnreadableShardError:
        raise  # to write it again might lose a sound one
    except (ShardError, *H5_ERRORS):
        return False
