"""Files that tell a planner what six images don't: cameras, where the car was, where it is to go."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.learn.predict.calibration_file import KEYS, Calibration
from ogmkit.learn.predict.json_values import Reader, checked, json_object, numbers
from ogmkit.samples.index import SEQUENCE
from ogmkit.typing import FloatArray

_NO_DIRECTION_M = 1e-6
"""Below this distance a destination's direction is noise."""
_AT_ORIGIN_M = 1e-3
_FARTHEST_M = 1e6


@dataclass(frozen=True, eq=False)
class PlanFile:
    """What is known of six images, t = −5 … 0, oldest first.

    Attributes:
        path: the file.
        calibrations: six, of each image.
        positions: (6, 2) float64 of the ego at each image, metres, level frame of the last one; NaN where the
            file leaves them out.
        destination: (2,) float64 in the same frame, not its origin; NaN where the file leaves it out.
    """

    path: Path
    calibrations: tuple[Calibration, ...]
    positions: FloatArray
    destination: FloatArray

    @property
    def places(self) -> tuple[str, ...]:
        """What messages call what it says of each image."""
        return tuple(f"{self.path}: image {number} of {SEQUENCE}" for number in range(1, SEQUENCE + 1))


def read_plan_file(path: Path, needs: Sequence[str]) -> PlanFile:
    """Read and check such a file.

    Args:
        path: JSON, see `docs/predict.md`.
        needs: keys that must be there.

    Raises:
        TableError: the file is absent or no JSON, a needed key is missing, a key is unknown, or a value is
            not as it should be; names file and key.
    """
    values = checked(json_object(path, _PLAN_KEYS), _PLAN_KEYS, needs, str(path))
    positions = values.pop("positions", np.full((SEQUENCE, 2), np.nan))
    destination = values.pop("destination", np.full(2, np.nan))
    calibrations = tuple(
        Calibration(**{key: value[image] for key, value in values.items()}) for image in range(SEQUENCE)
    )
    return PlanFile(path, calibrations, positions, destination)


def _for_all(reader: Reader) -> Reader:
    """Reads one value, which holds for all six images."""
    return lambda key, value: (reader(key, value),) * SEQUENCE


def _for_each(reader: Reader) -> Reader:
    """Reads a matrix that holds for all six images, or a list of six."""

    def read(key: str, value: object) -> tuple[Any, ...]:
        if not (isinstance(value, list) and value and all(map(_is_matrix, value))):
            return (reader(key, value),) * SEQUENCE
        if len(value) != SEQUENCE:
            raise ValueError(f"{key} holds {len(value)} matrices, not one or {SEQUENCE}")
        return tuple(reader(f"{key}, matrix {number},", one) for number, one in enumerate(value, start=1))

    return read


def _is_matrix(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, list) for row in value)


def _positions(key: str, value: object) -> FloatArray:
    positions = numbers(key, value, SEQUENCE, 2)
    _require_near(key, positions)
    x, y = positions[-1].tolist()
    if max(abs(x), abs(y)) > _AT_ORIGIN_M:
        raise ValueError(
            f"{key} ends at ({x:g}, {y:g}), not (0, 0): give metres in the last image's level frame, "
            "oldest first"
        )
    return positions


def _destination(key: str, value: object) -> FloatArray:
    if (
        not isinstance(value, list)
        or len(value) != 2
        or any(type(entry) not in (int, float) for entry in value)
    ):
        raise ValueError(f"{key} is not [x, y] in metres")
    destination = numbers(key, [value], 1, 2).reshape(2)
    _require_near(key, destination)
    if np.hypot(*destination) < _NO_DIRECTION_M:
        raise ValueError(
            f"{key} is the origin, which has no direction; for a car that stays, give a point just ahead, "
            "such as [0.01, 0]"
        )
    return destination


def _require_near(key: str, points: FloatArray) -> None:
    if np.abs(points).max() > _FARTHEST_M:
        raise ValueError(
            f"{key} holds a number over {_FARTHEST_M:g} m; give metres in the last image's level frame"
        )


_PLAN_KEYS: Mapping[str, Callable[[str, object], Any]] = {
    "camera": _for_all(KEYS["camera"]),
    "image_size": _for_all(KEYS["image_size"]),
    "intrinsics": _for_each(KEYS["intrinsics"]),
    "level_from_camera": _for_each(KEYS["level_from_camera"]),
    "bev_from_image": _for_each(KEYS["bev_from_image"]),
    "positions": _positions,
    "destination": _destination,
}
"""Keys of the file, with what reads and checks their values: a calibration's give six."""
