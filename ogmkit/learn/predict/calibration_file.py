"""Calibration files: JSON that says where cameras and LiDARs of a user's own recordings are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.base.names import unknown
from ogmkit.errors import TableError
from ogmkit.learn.predict.json_values import Reader, checked, json_object, numbers
from ogmkit.typing import FloatArray

_MAX_SIDE_PX = 1 << 16
_TOLERANCE = 1e-4
"""How far a rotation's rows may be from unit length and right angles: printed with five digits it passes."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """What is known of one input; what the file leaves out is None.

    Attributes:
        camera: channel.
        image_size: (height, width) in pixels; (0, 0) where the file leaves it out.
        intrinsics: (3, 3) float64, pixel centres at integers.
        level_from_camera: (4, 4) float64.
        level_from_lidar: (4, 4) float64.
        bev_from_image: (3, 3) float64, pixels to cells of the run's grid, of any scale.
    """

    camera: str | None = None
    image_size: tuple[int, int] = (0, 0)
    intrinsics: FloatArray | None = None
    level_from_camera: FloatArray | None = None
    level_from_lidar: FloatArray | None = None
    bev_from_image: FloatArray | None = None


@dataclass(frozen=True)
class CalibrationFile:
    """A calibration file, parsed and not yet checked.

    Attributes:
        path: the file.
        content: one object for all inputs, or one by each input's name.
        by_name: which of the two.
    """

    path: Path
    content: Mapping[str, Any]
    by_name: bool

    def calibration(self, name: str, needs: Sequence[str]) -> Calibration:
        """What the file says of an input.

        Args:
            name: the input's file name.
            needs: keys that must be there.

        Raises:
            TableError: the input or a needed key is missing, a key is unknown, or a value is not as it should
                be; names file, input and key.
        """
        place, values = self.place(name), self.content
        if self.by_name:
            if name not in self.content:
                raise TableError(f"{self.path}: {unknown('image', name, tuple(self.content))}; add it")
            values = self.content[name]
        return Calibration(**checked(values, KEYS, needs, place))

    def place(self, name: str) -> str:
        """What messages call what it says of an input."""
        return f"{self.path}: {name}" if self.by_name else str(self.path)


def read_calibration_file(path: Path) -> CalibrationFile:
    """Parse a calibration file.

    Raises:
        TableError: it is absent, no JSON, or no object of the two forms.
    """
    content = json_object(path, KEYS)
    nested = [isinstance(value, dict) for value in content.values()]
    if any(nested) and not all(nested):
        raise TableError(f"{path}: holds neither one calibration nor one for each image; correct it")
    return CalibrationFile(path, content, all(nested))


def _text(key: str, value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{key} is not a text")
    return value


def _size(key: str, value: object) -> tuple[int, int]:
    if (
        not isinstance(value, list)
        or len(value) != 2
        or not all(type(side) is int and 0 < side <= _MAX_SIDE_PX for side in value)
    ):
        raise ValueError(f"{key} is not [height, width] in whole pixels")
    height, width = value
    return height, width


def _intrinsics(key: str, value: object) -> FloatArray:
    matrix = numbers(key, value, 3, 3)
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        raise ValueError(f"{key} has a focal length that is not positive")
    if matrix[1, 0] != 0 or matrix[2].tolist() != [0, 0, 1]:
        raise ValueError(f"{key} is not upper triangular with 1 in its corner")
    return matrix


def _pose(key: str, value: object) -> FloatArray:
    matrix = numbers(key, value, 4, 4)
    if matrix[3].tolist() != [0, 0, 0, 1]:
        raise ValueError(f"{key} does not end in the row 0, 0, 0, 1")
    rotation = matrix[:3, :3]
    straight = np.abs(rotation @ rotation.T - np.eye(3)).max() <= _TOLERANCE
    if not straight or np.linalg.det(rotation) < 0:
        raise ValueError(f"{key} holds no rotation: rows are not of length 1, upright and right-handed")
    return matrix


def _homography(key: str, value: object) -> FloatArray:
    return numbers(key, value, 3, 3)


KEYS: Mapping[str, Reader] = {
    "camera": _text,
    "image_size": _size,
    "intrinsics": _intrinsics,
    "level_from_camera": _pose,
    "level_from_lidar": _pose,
    "bev_from_image": _homography,
}
"""Keys of a calibration, with what reads and checks their values."""
