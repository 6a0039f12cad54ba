"""A camera at one moment: its rays in `global`, and the ground's distance along them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.geometry.se3 import inverse
from ogmkit.synthetic.ground import HeightFunction
from ogmkit.synthetic.terrain import SlopeProfile, flat_inverse_distance, slope_profile
from ogmkit.typing import Float32Array, FloatArray

_PIXELS_PER_AZIMUTH = 4


@dataclass(frozen=True, eq=False)
class View:
    """A pinhole camera over a scene.

    Attributes:
        intrinsics: (3, 3).
        global_from_camera: (4, 4).
        image_size: height, width in pixels.
        height: the ground, or None where it is flat at z = 0.

    Raises:
        SettingsError: a size without pixels, or a camera that is not above the ground.
    """

    intrinsics: FloatArray
    global_from_camera: FloatArray
    image_size: tuple[int, int]
    height: HeightFunction | None

    def __post_init__(self) -> None:
        if min(self.image_size) < 1:
            raise SettingsError(f"image size {self.image_size} has no pixels; give height, width")
        if self.height_above_ground_m <= 0:
            raise SettingsError(f"camera at {self.origin} is not above the ground; give another pose")

    @property
    def origin(self) -> FloatArray:
        """Optical centre in `global`."""
        return self.global_from_camera[:3, 3]

    @cached_property
    def camera_from_global(self) -> FloatArray:
        """Inverse of the pose."""
        return inverse(self.global_from_camera)

    @cached_property
    def height_above_ground_m(self) -> float:
        """Of the optical centre."""
        return float(self.origin[2] - self.ground_height(self.origin[:2]))

    def ground_height(self, points_xy: FloatArray) -> FloatArray:
        """Height (...) of the ground at `global` (..., 2) positions, metres."""
        return np.zeros(points_xy.shape[:-1]) if self.height is None else self.height(points_xy)

    def directions(self, rows: FloatArray, columns: FloatArray) -> Float32Array:
        """Rays (3, R, C) in `global` through pixels; one unit of a ray is one metre of depth."""
        global_from_pixel = self.global_from_camera[:3, :3] @ np.linalg.inv(self.intrinsics)
        along_u = np.multiply.outer(global_from_pixel[:, 0], columns) + global_from_pixel[:, 2:]
        along_v = np.multiply.outer(global_from_pixel[:, 1], rows)
        rays: Float32Array = along_v.astype(np.float32)[:, :, None] + along_u.astype(np.float32)[:, None, :]
        return rays

    def ground_inverse_depth(self, directions: Float32Array) -> Float32Array:
        """1/depth (R, C) of the ground along rays (3, R, C); 0 or less where they miss it."""
        if self._profile is None:
            return flat_inverse_distance(self.origin, directions)
        return self._profile.inverse_distance(directions)

    @cached_property
    def _profile(self) -> SlopeProfile | None:
        if self.height is None:
            return None
        height_px, width_px = self.image_size
        rim = self.directions(np.linspace(0, height_px - 1.0, 5), np.linspace(0, width_px - 1.0, 5))
        ahead = np.arctan2(self.global_from_camera[1, 2], self.global_from_camera[0, 2])
        turned = np.angle(np.exp(1j * (np.arctan2(rim[1], rim[0]) - ahead)))
        first, last = ahead + turned.min() - 0.01, ahead + turned.max() + 0.01
        return slope_profile(self.height, self.origin, first, last, 2 + width_px // _PIXELS_PER_AZIMUTH)
