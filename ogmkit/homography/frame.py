"""What the estimators know of one frame: a calibrated camera and boxes, in the level frame."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array

_MIN_DEPTH_M = 1.0


@dataclass(frozen=True, eq=False)
class FrameGeometry:
    """One camera image's geometry; M boxes.

    Attributes:
        intrinsics: (3, 3) float64.
        level_from_camera: (4, 4) float64.
        level_from_ego: (4, 4) float64: how the body is pitched and rolled.
        image_size: (height, width) in pixels.
        level_from_box: (M, 4, 4) float64; the origin is the box's centre.
        size_wlh: (M, 3) float64, metres.
        category: M full category names.
        visibility: (M,) uint8, 1 to 4; 0 = unknown.
        num_lidar_pts: (M,) int64; −1 = unknown.

    Raises:
        SettingsError: shapes disagree, a number is not finite, or the intrinsics are singular.
    """

    intrinsics: FloatArray
    level_from_camera: FloatArray
    level_from_ego: FloatArray
    image_size: tuple[int, int]
    level_from_box: FloatArray
    size_wlh: FloatArray
    category: tuple[str, ...]
    visibility: UInt8Array
    num_lidar_pts: IntArray

    def __post_init__(self) -> None:
        boxes = len(self.category)
        expected = {
            "intrinsics": (3, 3),
            "level_from_camera": (4, 4),
            "level_from_ego": (4, 4),
            "level_from_box": (boxes, 4, 4),
            "size_wlh": (boxes, 3),
            "visibility": (boxes,),
            "num_lidar_pts": (boxes,),
        }
        for name, shape in expected.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise SettingsError(f"frame geometry: {name} has shape {array.shape}, expected {shape}")
            if not np.isfinite(array).all():
                raise SettingsError(f"frame geometry: {name} holds a number that is not finite")
        if np.linalg.det(self.intrinsics) == 0:
            raise SettingsError("frame geometry: the intrinsics are singular")

    def __len__(self) -> int:
        return len(self.category)

    @cached_property
    def camera_from_level(self) -> FloatArray:
        """(4, 4) float64."""
        return inverse(self.level_from_camera)

    @cached_property
    def ground_corners_level(self) -> FloatArray:
        """(M, 4, 3) corners of the boxes' ground faces, metres, level frame."""
        return ground_corners(self.level_from_box, self.size_wlh)

    @cached_property
    def bottoms_level(self) -> FloatArray:
        """(M, 3) centres of the boxes' ground faces, metres, level frame."""
        centres: FloatArray = self.ground_corners_level.mean(axis=1)
        return centres

    @cached_property
    def ground_corners_px(self) -> FloatArray:
        """(M, 4, 2) the same corners in the image; meaningful only where they are in front of the camera."""
        return self._projected_corners[0]

    @cached_property
    def wholly_visible(self) -> BoolArray:
        """(M,) boxes whose four ground corners all lie inside the image, at least 1 m deep."""
        pixels, depth_m = self._projected_corners
        height, width = self.image_size
        inside = np.all((pixels >= 0) & (pixels <= (width - 1, height - 1)), axis=-1)
        visible: BoolArray = np.all(inside & (depth_m >= _MIN_DEPTH_M), axis=-1)
        return visible

    @cached_property
    def range_m(self) -> FloatArray:
        """(M,) horizontal distance of the boxes' centres from the ego's origin."""
        distance: FloatArray = np.hypot(self.level_from_box[:, 0, 3], self.level_from_box[:, 1, 3])
        return distance

    @cached_property
    def _projected_corners(self) -> tuple[FloatArray, FloatArray]:
        return self.project_level(self.ground_corners_level)

    def project_level(self, points_level: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Project (..., N, 3) points of the level frame: (..., N, 2) pixels and (..., N) depth in metres."""
        return project(self.intrinsics, transform_points(self.camera_from_level, points_level))
