"""Frame records: all that targets are made from, frozen, light and picklable."""

from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path

import numpy as np

from ogmkit.base.steps import STEP_S, STEPS, nearest_rows
from ogmkit.geometry.se3 import level_from_global, transform_points
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array

AROUND = range(-STEPS, STEPS + 1)
"""Steps at which a frame's record knows its neighbours."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """Annotated 3D boxes of one frame, as columns; M boxes.

    Attributes:
        annotation_token: M tokens.
        instance_token: M tokens, the same for one object over time.
        category: M full category names, such as `vehicle.car`.
        global_from_box: (M, 4, 4) float64; the origin is the box's centre, x its front.
        size_wlh: (M, 3) float64, width, length, height in metres.
        visibility: (M,) uint8, 1 to 4 as nuScenes' levels, 0 = unknown.
        num_lidar_pts: (M,) int64; −1 where the dataset doesn't say.
    """

    annotation_token: tuple[str, ...]
    instance_token: tuple[str, ...]
    category: tuple[str, ...]
    global_from_box: FloatArray
    size_wlh: FloatArray
    visibility: UInt8Array
    num_lidar_pts: IntArray

    def __len__(self) -> int:
        return len(self.annotation_token)

    def part(self, first: int, stop: int) -> "Boxes":
        """Boxes first … stop − 1."""
        return Boxes(*(getattr(self, field.name)[first:stop] for field in fields(self)))

    def selected(self, keep: BoolArray) -> "Boxes":
        """The boxes where the (M,) mask holds."""
        return Boxes(
            annotation_token=_where(self.annotation_token, keep),
            instance_token=_where(self.instance_token, keep),
            category=_where(self.category, keep),
            global_from_box=self.global_from_box[keep],
            size_wlh=self.size_wlh[keep],
            visibility=self.visibility[keep],
            num_lidar_pts=self.num_lidar_pts[keep],
        )


@dataclass(frozen=True, eq=False)
class LidarRecord:
    """One LiDAR sweep: its file and its own pose, which differs from the camera's by tens of milliseconds.

    Attributes:
        path: relative to the dataset's root.
        timestamp_us: the sweep's.
        global_from_lidar: (4, 4) float64.
    """

    path: str
    timestamp_us: int
    global_from_lidar: FloatArray


@dataclass(frozen=True, eq=False)
class FrameRecord:
    """One key frame of one camera; nothing is read from files until asked for.

    Attributes:
        dataroot: the dataset's root folder.
        scene_name: such as `scene-0103`.
        location: the map's name, such as `boston-seaport`.
        map_path: the drivable-area mask, relative to the root; empty where none is asked for.
        camera: channel name, such as `CAM_FRONT`.
        sample_token: the key frame's token.
        sample_data_token: the image's token.
        timestamp_us: the image's own.
        image_path: relative to the root.
        image_size: (height, width) in pixels.
        intrinsics: (3, 3) float64.
        ego_from_camera: (4, 4) float64.
        global_from_ego: (4, 4) float64, the ego pose of the image (design.md §1), not the LiDAR's.
        boxes: all annotations of the sample, at the sample's time.
        neighbour_timestamps_us: (13,) int64 of this camera's key frames at steps −6 … +6, as `neighbours`
            finds them; −1 where there is none.
        neighbour_positions_global: (13, 3) float64 of the ego there; NaN where there is none.
        lidar: the sample's LiDAR sweep, None where the dataset has none.
    """

    dataroot: Path
    scene_name: str
    location: str
    map_path: str
    camera: str
    sample_token: str
    sample_data_token: str
    timestamp_us: int
    image_path: str
    image_size: tuple[int, int]
    intrinsics: FloatArray
    ego_from_camera: FloatArray
    global_from_ego: FloatArray
    boxes: Boxes
    neighbour_timestamps_us: IntArray
    neighbour_positions_global: FloatArray
    lidar: LidarRecord | None

    @cached_property
    def level_from_global(self) -> FloatArray:
        """(4, 4) float64 into this frame's level frame."""
        return level_from_global(self.global_from_ego)

    @property
    def level_from_camera(self) -> FloatArray:
        """(4, 4) float64 from the camera into this frame's level frame."""
        result: FloatArray = self.level_from_global @ self.global_from_ego @ self.ego_from_camera
        return result

    @property
    def lidar_centre_level(self) -> FloatArray:
        """(3,) where the LiDAR was when it swept, metres, this frame's level frame; NaN without a sweep."""
        if self.lidar is None:
            return np.full(3, np.nan)
        centre_global = self.lidar.global_from_lidar[None, :3, 3]
        result: FloatArray = transform_points(self.level_from_global, centre_global)[0]
        return result


@dataclass(frozen=True, eq=False)
class KeyFrame:
    """One sample at the time of its LiDAR sweep: what labels round the vehicle are made from.

    Attributes:
        dataroot: the dataset's root folder.
        location: the map's name, such as `boston-seaport`.
        sample_token: the sample's token.
        global_from_ego: (4, 4) float64, the ego pose of the sweep.
        ego_from_lidar: (4, 4) float64, mounting of the LiDAR.
        lidar_path: the sweep's file, relative to the root; it may be absent.
        boxes: all annotations of the sample, in the table's order.
        camera: the front camera's frame of the sample; None where none is asked for.
        map_path: the drivable-area mask, relative to the root; empty where none is asked for.
    """

    dataroot: Path
    location: str
    sample_token: str
    global_from_ego: FloatArray
    ego_from_lidar: FloatArray
    lidar_path: str
    boxes: Boxes
    camera: FrameRecord | None = None
    map_path: str = ""


@dataclass(frozen=True)
class LeftOutFrame:
    """A frame that isn't among its camera's, since a file that it needs is absent or bad.

    Attributes:
        sample_data_token: the image's token.
        timestamp_us: the image's own.
        reason: what is wrong, in a few words.
    """

    sample_data_token: str
    timestamp_us: int
    reason: str


@dataclass(frozen=True, eq=False)
class SceneRecord:
    """One scene: its frames by camera, in temporal order.

    Attributes:
        name: the scene's name.
        location: the map's name.
        cameras: channel name → that camera's frames.
        left_out: channel name → frames that are not among them, in temporal order; no entry where none is.
        log: token of the drive that the scene is cut from; empty where it is not known.
        key_frames: its samples, in temporal order; none where only the paper's labels are wanted.
    """

    name: str
    location: str
    cameras: dict[str, tuple[FrameRecord, ...]]
    left_out: dict[str, tuple[LeftOutFrame, ...]] = field(default_factory=dict)
    log: str = ""
    key_frames: tuple[KeyFrame, ...] = ()


def neighbours(
    times_us: IntArray, positions_global: FloatArray, step_s: float = STEP_S
) -> tuple[IntArray, FloatArray]:
    """Times and positions of the frames around each frame, as its `FrameRecord` holds them.

    Args:
        times_us: (N,) int64 of a camera's key frames, in temporal order, at any rate.
        positions_global: (N, 3) float64 of the ego there, metres.
        step_s: time from one step to the next, as the targets' settings have it.

    Returns:
        (N, 13) times and (N, 13, 3) positions at steps −6 … +6; −1 and NaN where no frame is near enough.
    """
    rows = nearest_rows(times_us, AROUND, step_s)
    there = rows >= 0
    return np.where(there, times_us[rows], -1), np.where(there[..., None], positions_global[rows], np.nan)


def _where(names: tuple[str, ...], keep: BoolArray) -> tuple[str, ...]:
    return tuple(names[i] for i in np.flatnonzero(keep))
