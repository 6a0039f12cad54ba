"""The sensor rig: six cameras and a LiDAR, mounted as on a nuScenes vehicle.

Figures follow the calibrated sensors of the public nuScenes tables, rounded.
"""

from dataclasses import dataclass

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.typing import FloatArray

LIDAR = "LIDAR_TOP"

NATIVE_SIZE = (900, 1600)
"""Height and width in pixels for which the intrinsics below hold."""


@dataclass(frozen=True)
class Mount:
    """Where a sensor sits on the body: the `ego_from_sensor` transform in nuScenes' terms.

    Attributes:
        translation_m: the sensor's origin in `ego`.
        rotation_wxyz: unit quaternion, `ego_from_sensor`.
    """

    translation_m: tuple[float, float, float]
    rotation_wxyz: tuple[float, float, float, float]


@dataclass(frozen=True)
class CameraMount(Mount):
    """A camera: square pixels, no skew, no distortion.

    Attributes:
        focal_px: focal length at `NATIVE_SIZE`.
        centre_px: principal point (u, v) at `NATIVE_SIZE`; integer = pixel centre.
    """

    focal_px: float
    centre_px: tuple[float, float]


def _unit(w: float, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    norm = float(np.sqrt(w * w + x * x + y * y + z * z))
    return w / norm, x / norm, y / norm, z / norm


CAMERA_MOUNTS = {
    "CAM_FRONT": CameraMount(
        (1.70, 0.016, 1.51), _unit(0.4998, -0.5030, 0.4998, -0.4974), 1266.4, (816.3, 491.5)
    ),
    "CAM_FRONT_RIGHT": CameraMount(
        (1.55, -0.493, 1.50), _unit(0.2060, -0.2027, 0.6825, -0.6714), 1260.8, (808.0, 495.3)
    ),
    "CAM_BACK_RIGHT": CameraMount(
        (1.01, -0.481, 1.56), _unit(0.1228, -0.1324, -0.7004, 0.6905), 1259.5, (807.3, 501.2)
    ),
    "CAM_BACK": CameraMount(
        (0.03, 0.003, 1.58), _unit(0.5038, -0.4974, -0.4942, 0.5045), 809.2, (829.2, 481.8)
    ),
    "CAM_BACK_LEFT": CameraMount(
        (1.04, 0.485, 1.59), _unit(0.6924, -0.7032, -0.1165, 0.1120), 1256.7, (792.1, 492.8)
    ),
    "CAM_FRONT_LEFT": CameraMount(
        (1.52, 0.495, 1.51), _unit(0.6757, -0.6736, 0.2121, -0.2112), 1272.6, (826.6, 479.8)
    ),
}
"""The six cameras by channel, clockwise from the front, seen from above."""

LIDAR_MOUNT = Mount((0.944, 0.0, 1.84), _unit(0.7078, -0.0065, 0.0106, -0.7063))


def scaled_intrinsics(channel: str, image_size: tuple[int, int]) -> FloatArray:
    """Intrinsics of a camera whose whole native image is resized.

    Integer pixels are centres, so a factor s moves pixel u to s·(u + 0.5) − 0.5.

    Args:
        channel: a key of `CAMERA_MOUNTS`.
        image_size: height, width in pixels; another aspect ratio than the native one stretches.

    Returns:
        (3, 3) float64.

    Raises:
        SettingsError: unknown channel or a size without pixels.
    """
    if channel not in CAMERA_MOUNTS:
        raise SettingsError(f"camera {channel} is unknown; there are {', '.join(CAMERA_MOUNTS)}")
    if min(image_size) < 1:
        raise SettingsError(f"image size {image_size} has no pixels; give height, width")
    mount = CAMERA_MOUNTS[channel]
    scale_v, scale_u = image_size[0] / NATIVE_SIZE[0], image_size[1] / NATIVE_SIZE[1]
    centre_u, centre_v = mount.centre_px
    return np.array(
        [
            [scale_u * mount.focal_px, 0.0, scale_u * (centre_u + 0.5) - 0.5],
            [0.0, scale_v * mount.focal_px, scale_v * (centre_v + 0.5) - 0.5],
            [0.0, 0.0, 1.0],
        ]
    )
