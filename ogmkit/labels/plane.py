"""The plane that a label's cells lie on: from the map's coordinates to the two that its axes name."""

from dataclasses import dataclass, replace

import numpy as np

from ogmkit.errors import TableError
from ogmkit.frames import FrameRecord, KeyFrame
from ogmkit.geometry.se3 import heading_rad, level_from_global
from ogmkit.labels.definition import Frame
from ogmkit.typing import FloatArray


@dataclass(frozen=True, eq=False)
class Plane:
    """An affine map from the global frame; points are moved to the origin first, to lose no digits.

    Attributes:
        local_from_global: (2, 3) float64.
        origin_global: (3,) metres.
        offset_m: (2,) added to what comes out.
        names: of the two coordinates.
        turn_rad: angle about z from the global frame, where the plane is only turned.
    """

    local_from_global: FloatArray
    origin_global: FloatArray
    offset_m: FloatArray
    names: tuple[str, str] = ("x", "y")
    turn_rad: float = 0.0

    def local(self, points_global: FloatArray) -> FloatArray:
        """(..., 3) metres, global frame, to (..., 2) metres on the plane."""
        centred = points_global - self.origin_global
        result: FloatArray = centred @ self.local_from_global.T + self.offset_m
        return result

    @property
    def centre_global(self) -> FloatArray:
        """(2,) where the plane's own origin lies on the map."""
        result: FloatArray = self.origin_global[:2] - np.linalg.solve(
            self.local_from_global[:, :2], self.offset_m
        )
        return result

    def in_space(self, ground_global: FloatArray) -> FloatArray:
        """(4, 4) from the global frame: the plane's coordinates, and the height over it.

        Args:
            ground_global: (3,) a point whose height is 0, metres.
        """
        matrix = np.eye(4)
        matrix[:2, :3] = self.local_from_global
        matrix[2, :3] = np.cross(*self.local_from_global)
        matrix[:2, 3] = self.offset_m - self.local_from_global @ self.origin_global
        matrix[2, 3] = -matrix[2, :3] @ ground_global
        return matrix

    def local_2d(self, points_global: FloatArray) -> FloatArray:
        """The same of (..., 2) points of a map, as if the plane were level."""
        centred = points_global - self.origin_global[:2]
        result: FloatArray = centred @ self.local_from_global[:, :2].T + self.offset_m
        return result


def plane_of(frame: Frame, key_frame: KeyFrame) -> Plane:
    """The plane of a definition's frame.

    - `lidar-ego`: the ego pose of the sweep, its whole rotation, z dropped.
    - `lidar-ego-yaw`: its position, turned about z by `intrinsic_yaw_rad`.
    - `lidar-ego-yaw-float32`: the same, rotation and translation rounded to float32.
    - `lidar-heading`: the LiDAR's own position and the heading of its x axis (the car's right), float32.
    - `camera`: the camera's right and ahead as they lie on the map.
    - `image-level`: the level frame of the camera's ego pose.
    - `lidar-level`: that of the sweep's.

    Raises:
        TableError: the frame is a camera's, and the key frame has none.
    """
    if frame == "camera":
        return _camera(front_of(key_frame))
    if frame == "lidar-heading":
        return _heading(key_frame)
    if frame in ("image-level", "lidar-level"):
        return _level((front_of(key_frame) if frame == "image-level" else key_frame).global_from_ego)
    pose = key_frame.global_from_ego
    if frame == "lidar-ego":
        return _at(pose[:3, :3], pose[:3, 3])
    yaw = intrinsic_yaw_rad(pose)
    if frame == "lidar-ego-yaw":
        return _at(_about_z(yaw), pose[:3, 3])
    return _rounded(_about_z(yaw), pose[:3, 3])


def intrinsic_yaw_rad(global_from_ego: FloatArray) -> float:
    """The z angle of R = Rx·Ry·Rz, which pyquaternion calls yaw: not the heading, unless there is no tilt."""
    return float(np.arctan2(-global_from_ego[0, 1], global_from_ego[0, 0]))


def front_of(key_frame: KeyFrame) -> FrameRecord:
    """The front camera's frame of a sample.

    Raises:
        TableError: there is none.
    """
    if key_frame.camera is None:
        raise TableError(f"sample {key_frame.sample_token}: has no frame of the front camera; leave it out")
    return key_frame.camera


def _about_z(angle_rad: float) -> FloatArray:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _at(global_from_local: FloatArray, origin_global: FloatArray) -> Plane:
    """Of a (3, 3) rotation and an origin."""
    return Plane(global_from_local.T[:2], origin_global, np.zeros(2))


def _level(global_from_ego: FloatArray) -> Plane:
    return _at(level_from_global(global_from_ego)[:3, :3].T, global_from_ego[:3, 3])


def _rounded(global_from_local: FloatArray, origin_global: FloatArray) -> Plane:
    """As `_at` with one matrix in float32; its translation is found in float64 from a float32 origin."""
    rotation = global_from_local.T
    moved = rotation @ -origin_global.astype(np.float32).astype(np.float64)
    return Plane(_as_float32(rotation[:2]), np.zeros(3), _as_float32(moved[:2]))


def _as_float32(values: FloatArray) -> FloatArray:
    return values.astype(np.float32).astype(np.float64)


def _heading(key_frame: KeyFrame) -> Plane:
    pose = key_frame.global_from_ego.astype(np.float32) @ key_frame.ego_from_lidar.astype(np.float32)
    global_from_lidar = pose.astype(np.float64)
    heading = float(heading_rad(global_from_lidar))
    return replace(_at(_about_z(heading), global_from_lidar[:3, 3]), turn_rad=heading)


def _camera(frame: FrameRecord) -> Plane:
    """Where pitch or roll tilt the camera, the two axes are not quite of unit length on the map."""
    global_from_camera = frame.global_from_ego @ frame.ego_from_camera
    map_from_local = global_from_camera[:2][:, [0, 2]]
    matrix = np.zeros((2, 3))
    matrix[:, :2] = np.linalg.inv(map_from_local)
    return Plane(matrix, global_from_camera[:3, 3] * [1, 1, 0], np.zeros(2), ("x", "z"))
