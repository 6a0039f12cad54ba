"""The ego's sensors as one log has them mounted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pyquaternion import Quaternion

from ogmkit.geometry.se3 import pose_matrix
from ogmkit.synthetic.rig import CAMERA_MOUNTS, LIDAR, LIDAR_MOUNT, Mount, scaled_intrinsics
from ogmkit.typing import FloatArray

_SHIFT_M = 0.01
_TILT_RAD = np.radians(0.35)


@dataclass(frozen=True, eq=False)
class Sensor:
    """One sensor in one log, in the numbers that the tables hold.

    Attributes:
        channel: such as `CAM_FRONT`.
        translation: its origin in `ego`.
        rotation: quaternion [w, x, y, z], ego from sensor.
        intrinsics: (3, 3), None for the LiDAR.
    """

    channel: str
    translation: list[float]
    rotation: list[float]
    intrinsics: FloatArray | None

    @property
    def ego_from_sensor(self) -> FloatArray:
        """(4, 4)."""
        return pose_matrix(self.translation, self.rotation)


def mounted_sensors(
    channels: Sequence[str], image_size: tuple[int, int], random: np.random.Generator | None
) -> tuple[Sensor, ...]:
    """Sensors of one log.

    Args:
        channels: cameras, and the LiDAR's name where it is wanted.
        image_size: height and width of the images.
        random: source of small differences in mounting; None for none.
    """
    return tuple(_mounted(channel, image_size, random) for channel in channels)


def _mounted(channel: str, image_size: tuple[int, int], random: np.random.Generator | None) -> Sensor:
    mount: Mount = LIDAR_MOUNT if channel == LIDAR else CAMERA_MOUNTS[channel]
    translation, rotation = np.array(mount.translation_m), Quaternion(mount.rotation_wxyz)
    if random is not None:
        translation = translation + random.uniform(-_SHIFT_M, _SHIFT_M, 3)
        axis = random.normal(size=3)
        rotation = Quaternion(axis=axis, angle=float(random.uniform(-_TILT_RAD, _TILT_RAD))) * rotation
    return Sensor(
        channel,
        [round(float(value), 6) for value in translation],
        [round(float(value), 8) for value in rotation.normalised.elements],
        None if channel == LIDAR else scaled_intrinsics(channel, image_size),
    )
