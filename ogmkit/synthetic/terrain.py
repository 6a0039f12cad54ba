"""Where rays meet the ground: exactly on flat ground, through slope profiles where there is relief.

Rays are given as origin + t · direction; functions return 1/t, which is 0 or less where a ray never lands. On
flat ground 1/t is linear in the direction, therefore affine in the pixel.
"""

from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np

from ogmkit.synthetic.ground import HeightFunction
from ogmkit.typing import Float32Array, FloatArray

FARTHEST_M = 600.0
"""Ground beyond this horizontal range is not seen."""
_NEAREST_M, _RANGES = 0.5, 240
_SLOPES = 2048
# Slopes are tabulated evenly in asinh(slope / this): finely where they are shallow, near the horizon.
_SHALLOW_SLOPE = 0.02
_STEEPEST_UNIT = float(np.arcsinh(4.0 / _SHALLOW_SLOPE))
_COLUMNS_PER_UNIT = (_SLOPES - 1) / (2 * _STEEPEST_UNIT)


_Floats = TypeVar("_Floats", Float32Array, FloatArray)


def flat_inverse_distance(origin: FloatArray, directions: _Floats) -> _Floats:
    """1/t (...) for (3, ...) directions from a `global` origin above the plane z = 0."""
    result: _Floats = directions[2] * float(-1 / origin[2])
    return result


def depth_from_inverse(inverse_depth: Float32Array) -> Float32Array:
    """Depth in metres, at most `FARTHEST_M`."""
    return np.reciprocal(np.maximum(inverse_depth, np.float32(1 / FARTHEST_M)))


@dataclass(frozen=True, eq=False)
class SlopeProfile:
    """How far a ray of any slope gets before it meets the ground, per azimuth, seen from one point.

    A ray of slope s lands where (height(r) − z) / r first reaches s. The running maximum of that quotient
    over the horizontal range r is monotone, so it is inverted once per azimuth and looked up for every ray.

    Attributes:
        inverse_range: (A, S) 1/r in 1/m; 0 where the ray leaves for the sky.
        first_azimuth: azimuth of row 0 in `global`, radians.
        azimuth_step: radians per row.
    """

    inverse_range: Float32Array
    first_azimuth: float
    azimuth_step: float

    def inverse_distance(self, directions: Float32Array) -> Float32Array:
        """1/t (H, W) for (3, H, W) `global` directions within the profile's azimuths."""
        horizontal, azimuth = cv2.cartToPolar(directions[0], directions[1])
        turned = np.mod(azimuth - np.float32(self.first_azimuth), np.float32(2 * np.pi))
        slope_unit = np.arcsinh(directions[2] / (horizontal * np.float32(_SHALLOW_SLOPE)))
        looked_up = cv2.remap(
            self.inverse_range,
            (slope_unit + np.float32(_STEEPEST_UNIT)) * np.float32(_COLUMNS_PER_UNIT),
            turned / np.float32(self.azimuth_step),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        landed: Float32Array = looked_up * horizontal
        return landed


def slope_profile(
    height: HeightFunction, origin: FloatArray, first_azimuth: float, last_azimuth: float, rows: int
) -> SlopeProfile:
    """Tabulate the ground around a point.

    Args:
        height: the ground.
        origin: (3,) the viewpoint in `global`, above the ground.
        first_azimuth: where the table starts, radians in `global`.
        last_azimuth: where it ends, counter-clockwise from the first.
        rows: number of azimuths.
    """
    azimuths = np.linspace(first_azimuth, last_azimuth, rows)
    inverse_ranges = np.geomspace(1 / _NEAREST_M, 1 / FARTHEST_M, _RANGES)
    rays = np.stack([np.cos(azimuths), np.sin(azimuths)], axis=-1)
    ground = height(origin[:2] + rays[:, None] / inverse_ranges[:, None])
    reached = np.maximum.accumulate((ground - origin[2]) * inverse_ranges, axis=1)
    slopes = _SHALLOW_SLOPE * np.sinh(np.linspace(-_STEEPEST_UNIT, _STEEPEST_UNIT, _SLOPES))
    table = np.stack([_invert(row, slopes, inverse_ranges) for row in reached])
    return SlopeProfile(table.astype(np.float32), first_azimuth, (last_azimuth - first_azimuth) / (rows - 1))


def _invert(reached: FloatArray, slopes: FloatArray, inverse_ranges: FloatArray) -> FloatArray:
    """1/r at which a monotone profile first reaches each slope; 0 beyond its end."""
    # Equal neighbours (ground hidden behind a crest) make the inverse ambiguous: keep the nearest of them.
    rising = np.concatenate([[True], np.diff(reached) > 0])
    # Below the nearest sample the ray lands nearer still: continue 1/r in proportion to the slope.
    below = slopes < reached[0]
    found: FloatArray = np.interp(slopes, reached[rising], inverse_ranges[rising], right=0.0)
    found[below] = inverse_ranges[0] * slopes[below] / reached[0]
    return found
