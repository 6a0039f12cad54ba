"""What a recording shows of a shard: read a frame at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.se3 import inverse
from ogmkit.pictures.masks import valid_homography
from ogmkit.pictures.views import image_file
from ogmkit.shards import schema
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_further import further_rasters
from ogmkit.shards.schema_seen import SEEN
from ogmkit.typing import Float32Array, FloatArray, UInt8Array

_SHOWN = "layers/", "classes/"


@dataclass(frozen=True)
class Moment:
    """One key frame of a scene.

    Attributes:
        number: its place among the scene's, from 0.
        time_us: of its first image.
        frames: camera → the frame's place among the camera's; a camera that lost the frame is absent.
    """

    number: int
    time_us: int
    frames: Mapping[str, int]


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """One frame of a camera; M boxes.

    Attributes:
        time_us: the image's own time.
        image: the JPEG file; None where there is none.
        image_size: (height, width).
        intrinsics: (3, 3), pixel centres at integers.
        global_from_level: (4, 4).
        level_from_camera: (4, 4).
        boxes: in the global frame.
        past: (6, 2) metres, level frame; NaN where missing.
        future: as `past`.
        speed_m_s: over the last step; NaN where unknown.
        rasters: name → (rows, columns) uint8 0/1.
        instances: (rows, columns) uint16; None where the shard has none.
        lidar: (P, 4) x, y, z in the level frame, and intensity; None where the shard has none.
        footprints: set → target → (h, w) uint8 0/1.
        homographies: source → (3, 3) cells from pixels; None where invalid.
    """

    time_us: int
    image: bytes | None
    image_size: tuple[int, int]
    intrinsics: FloatArray
    global_from_level: FloatArray
    level_from_camera: FloatArray
    boxes: Boxes
    past: FloatArray
    future: FloatArray
    speed_m_s: float
    rasters: Mapping[str, UInt8Array]
    instances: Any
    lidar: Float32Array | None
    footprints: Mapping[str, Mapping[str, UInt8Array]]
    homographies: Mapping[str, FloatArray | None]

    @property
    def level_from_box(self) -> FloatArray:
        """(M, 4, 4)."""
        found: FloatArray = inverse(self.global_from_level) @ self.boxes.global_from_box
        return found

    @property
    def camera_from_box(self) -> FloatArray:
        """(M, 4, 4)."""
        found: FloatArray = inverse(self.level_from_camera) @ self.level_from_box
        return found


def moments(shard: Shard, cameras: Sequence[str]) -> tuple[Moment, ...]:
    """The key frames of cameras, in temporal order.

    Raises:
        ShardError: the shard is damaged.
    """
    frames: dict[str, dict[str, int]] = {}
    times_us: dict[str, int] = {}
    for camera in cameras:
        stamps = shard.dataset(camera, "timestamp_us")[:].tolist()
        for index, (token, time_us) in enumerate(
            zip(shard.strings(camera, "sample_token"), stamps, strict=True)
        ):
            frames.setdefault(token, {})[camera] = index
            times_us[token] = min(time_us, times_us.get(token, time_us))
    ordered = sorted(frames, key=lambda token: times_us[token])
    return tuple(Moment(number, times_us[one], frames[one]) for number, one in enumerate(ordered))


def shown_rasters(shard: Shard) -> tuple[str, ...]:
    """Names of the masks of cells that a camera has beside targets and view: layers, classes, cells seen."""
    targets = shard.settings.targets
    further = (name for name in further_rasters(targets) if name.startswith(_SHOWN))
    return (*further, *(f"{SEEN}/{kind}" for kind in targets.seen[1:]))


def read_frame(shard: Shard, camera: str, index: int, dataroot: Path | None) -> CameraFrame:
    """Read a frame.

    Args:
        shard: open.
        camera: channel.
        index: its place among the camera's frames.
        dataroot: where images are that the shard only refers to; None leaves them out.

    Raises:
        ShardError: the shard is damaged, or lacks something.
        DataFileError, TableError: an image is absent or damaged, or lies outside `dataroot`.
    """

    def row(name: str) -> Any:  # noqa: ANN401  # arrays and scalars of several dtypes
        return shard.dataset(camera, name)[index]

    targets = shard.settings.targets
    height, width = row("image_size").tolist()
    level_from_global, past = row("level_from_global"), row("trajectory/past")
    names = ("vehicles", "field_of_view", *shown_rasters(shard))
    drivable = shard.drivable(camera, index)
    return CameraFrame(
        time_us=int(row("timestamp_us")),
        image=image_file(shard, camera, index, (height, width), dataroot),
        image_size=(height, width),
        intrinsics=row("intrinsics"),
        global_from_level=inverse(level_from_global),
        level_from_camera=level_from_global @ row("global_from_ego") @ row("ego_from_camera"),
        boxes=shard.boxes(camera, index),
        past=past,
        future=row("trajectory/future"),
        speed_m_s=float(np.hypot(*past[-1])) / targets.step_s,
        rasters=({} if drivable is None else {"drivable": drivable}) | {name: row(name) for name in names},
        instances=row("instances/id") if targets.instances else None,
        lidar=_lidar(shard, camera, index) if targets.lidar else None,
        footprints={
            name: _masks(shard, camera, name, index) for name in shard.added(camera, schema.FOOTPRINTS.name)
        },
        homographies={
            name: valid_homography(shard, camera, name, index) if row(f"homography/{name}/valid") else None
            for name in shard.added(camera, schema.HOMOGRAPHY.name)
        },
    )


def _lidar(shard: Shard, camera: str, index: int) -> Float32Array:
    first, stop = shard.dataset(camera, "lidar/offsets")[index : index + 2]
    points: Float32Array = shard.dataset(camera, "lidar/points")[int(first) : int(stop)]
    return points


def _masks(shard: Shard, camera: str, name: str, index: int) -> dict[str, UInt8Array]:
    """A set's masks; without maps there is none of drivable area."""
    known = ("vehicles",) if shard.settings.targets.no_map else ("drivable", "vehicles")
    place = f"{schema.FOOTPRINTS.name}/{name}"
    return {target: shard.dataset(camera, f"{place}/{target}")[index] for target in known}
