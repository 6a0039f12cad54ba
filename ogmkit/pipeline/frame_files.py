"""The files that a scene's frames need: which are absent, and what can be made without those that are bad."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from ogmkit.base.files import fault_of, file_status
from ogmkit.errors import DataFileError, FrameFileError, OgmkitError
from ogmkit.frames import FrameRecord, KeyFrame, LeftOutFrame, SceneRecord
from ogmkit.nuscenes.expansion import expansion_path
from ogmkit.nuscenes.mask_faults import is_vector_map
from ogmkit.nuscenes.paths import resolve
from ogmkit.raster.lidar import lidar_points_level
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings
from ogmkit.targets import read_image

What = Literal["image", "LiDAR sweep", "map mask", "map expansion"]
_OF_MAPS = ("map mask", "map expansion")

_INSTEAD = {
    "image": "such scenes (--only-complete), such frames (--skip-bad-frames) or all images (--images none)",
    "LiDAR sweep": "such scenes (--only-complete), such frames (--skip-bad-frames) or --lidar, --seen lidar",
    "map mask": "such scenes (--only-complete) or the drivable area (--no-map)",
    "map expansion": "such scenes (--only-complete) or --layers",
}
"""What can be left out to go on."""


@dataclass(frozen=True)
class Absence:
    """Files of one kind that are needed and not there.

    Attributes:
        what: the kind.
        cameras: whose frames need them.
        files: how many.
        first: one of them.
    """

    what: What
    cameras: tuple[str, ...]
    files: int
    first: Path

    @property
    def problem(self) -> str:
        """Which file is absent, and how many like it."""
        of = "" if self.what in _OF_MAPS else f" of {', '.join(self.cameras)}"
        alike = f", one of {self.files:,}{of}" if self.files > 1 else ""
        return f"{self.first}: {self.what} is absent{alike}"

    @property
    def remedy(self) -> str:
        """How to go on."""
        it = "them" if self.files > 1 else "it"
        return f"download {it}, or leave out {_INSTEAD[self.what]}"


@dataclass(frozen=True)
class Refusal:
    """Why a scene gives no shard.

    Attributes:
        error: the first reason.
        absent: files that it lacks, where that is the reason.
        left_out: whether the settings say to go on without the scene.
    """

    error: OgmkitError
    absent: tuple[Absence, ...] = ()
    left_out: bool = False


def prepare(scene: SceneRecord, settings: ExtractSettings, *, read: bool = True) -> SceneRecord | Refusal:
    """Look for the files that a scene needs, before anything is decoded.

    Args:
        scene: all frames by the tables.
        settings: what is extracted; they also say what is done about files that are absent or bad.
        read: whether frames that are to be skipped are found by reading; else only by looking for files.

    Returns:
        What can be written, perhaps without some frames.

    Raises:
        DataFileError: the system refuses to read a file.
        TableError: a file name leaves the dataset's root.
    """
    absent = absences(scene, settings.targets)
    if settings.skip_bad_frames and all(one.what not in _OF_MAPS for one in absent):
        return _of_sound_frames(scene, settings.targets, read=read)
    if not absent:
        return scene
    first = absent[0]
    error = DataFileError(f"{first.problem}; {first.remedy}", kind=f"{first.what} is absent")
    return Refusal(error, absent, settings.only_complete)


def absences(scene: SceneRecord, targets: TargetSettings) -> tuple[Absence, ...]:
    """The files of each kind that a scene's frames need and that are not there; none is opened."""
    needed: dict[tuple[What, Path], list[str]] = {}
    for camera, frames in scene.cameras.items():
        for frame in frames:
            for file in (*_frame_files(frame, targets), *_map_files(frame, targets)):
                needed.setdefault(file, []).append(camera)
    for file in (file for key_frame in scene.key_frames for file in _map_files(key_frame, targets)):
        needed.setdefault(file, [])
    return joined(
        Absence(what, tuple(dict.fromkeys(cameras)), 1, path)
        for (what, path), cameras in needed.items()
        if _is_absent(path)
    )


def joined(absences: Iterable[Absence]) -> tuple[Absence, ...]:
    """One for each kind of file, over several cameras or scenes."""
    found: dict[What, Absence] = {}
    for one in absences:
        before = found.setdefault(one.what, replace(one, files=0))
        cameras = tuple(dict.fromkeys((*before.cameras, *one.cameras)))
        found[one.what] = replace(before, cameras=cameras, files=before.files + one.files)
    return tuple(found.values())


def frame_fault(frame: FrameRecord, targets: TargetSettings, *, read: bool = True) -> str:
    """What is wrong with the files of a frame, in a few words; empty where they are sound.

    Raises:
        DataFileError, TableError: as `prepare`.
    """
    if not read:
        absent = (what for what, path in _frame_files(frame, targets) if _is_absent(path))
        return next((f"{what} is absent" for what in absent), "")
    try:
        if targets.images != "none":
            read_image(frame)
        if targets.lidar_source:
            lidar_points_level(frame)
    except FrameFileError as error:
        return error.kind
    return ""


def without(scene: SceneRecord, left_out: dict[str, tuple[LeftOutFrame, ...]]) -> SceneRecord:
    """The scene without some frames, which are given by camera."""
    cameras = {}
    for camera, frames in scene.cameras.items():
        tokens = {frame.sample_data_token for frame in left_out.get(camera, ())}
        cameras[camera] = tuple(frame for frame in frames if frame.sample_data_token not in tokens)
    return replace(scene, cameras=cameras, left_out={name: lost for name, lost in left_out.items() if lost})


def _of_sound_frames(scene: SceneRecord, targets: TargetSettings, *, read: bool) -> SceneRecord | Refusal:
    """The scene with the sound frames of each camera; none of it where a camera has no such frame."""
    left_out = {
        camera: tuple(
            LeftOutFrame(frame.sample_data_token, frame.timestamp_us, fault)
            for frame in frames
            if (fault := frame_fault(frame, targets, read=read))
        )
        for camera, frames in scene.cameras.items()
    }
    for camera, frames in scene.cameras.items():
        lost = left_out[camera]
        if frames and len(lost) == len(frames):
            path = frames[0].dataroot / frames[0].image_path
            error = FrameFileError(
                f"{path}: {lost[0].reason}, and so for every frame of {camera}; download it, or extract "
                f"without {camera}",
                kind=f"no frame of {camera} is sound",
            )
            return Refusal(error, left_out=True)
    return without(scene, left_out)


def _frame_files(frame: FrameRecord, targets: TargetSettings) -> Iterator[tuple[What, Path]]:
    if targets.images != "none":
        yield "image", resolve(frame.dataroot, frame.image_path)
    if targets.lidar_source and frame.lidar is not None:
        yield "LiDAR sweep", resolve(frame.dataroot, frame.lidar.path)


def _map_files(frame: FrameRecord | KeyFrame, targets: TargetSettings) -> Iterator[tuple[What, Path]]:
    """Of vector maps nobody wants the mask's file."""
    if targets.layers:
        yield "map expansion", expansion_path(frame.dataroot, frame.location)
    if frame.map_path and not targets.no_map and not is_vector_map(Path(frame.map_path)):
        yield "map mask", resolve(frame.dataroot, frame.map_path)


def _is_absent(path: Path) -> bool:
    try:
        file_status(path)
    except OSError as error:
        return fault_of(error) == "absent"
    return False
