"""Rolling ground, and how a vehicle's body stands on it."""

import numpy as np

from ogmkit.synthetic.catalogue import EGO_WHEELBASE_M
from ogmkit.synthetic.curves import direction
from ogmkit.synthetic.ground import HeightFunction
from ogmkit.synthetic.motion import Driving
from ogmkit.typing import FloatArray

_WAVES = 5
_WAVELENGTHS_M = (130.0, 320.0)
_TRACK_M = 1.5
_DIVE_RAD_PER_M_S2 = 0.007  # nose down when braking, up when speeding up
_SWAY_SHARE = 0.25
_SWAY_S = (7.0, 5.0)  # periods of pitch and roll
_ROLL_SHARE = 0.8


def rolling_ground(random: np.random.Generator, relief_m: float) -> HeightFunction:
    """A smooth height that varies by about `relief_m` within some hundred metres.

    Args:
        random: source of the waves.
        relief_m: usual difference between high and low ground, metres.
    """
    bearings = np.arange(_WAVES) * np.pi / _WAVES + random.uniform(-0.25, 0.25, _WAVES)
    wavelengths_m = random.uniform(*_WAVELENGTHS_M, _WAVES)
    phases = random.uniform(0, 2 * np.pi, _WAVES)
    numbers = 2 * np.pi / wavelengths_m * np.array([np.cos(bearings), np.sin(bearings)])
    # Sines of amplitude a add up to a standard deviation of a·√(n/2); high to low is about four of those.
    amplitude_m = relief_m / (4 * np.sqrt(_WAVES / 2))

    def height(xy: FloatArray) -> FloatArray:
        result: FloatArray = amplitude_m * np.sin(xy @ numbers + phases).sum(axis=-1)
        return result

    return height


def yaw_quaternion(heading_rad: float) -> list[float]:
    """Level attitude: [w, x, y, z]."""
    return [float(np.cos(heading_rad / 2)), 0.0, 0.0, float(np.sin(heading_rad / 2))]


def ego_pose(
    ego: Driving, time_s: float, height: HeightFunction | None, tilt_rad: float = 0.0
) -> tuple[list[float], list[float]]:
    """Translation and quaternion of the ego: level on flat ground, else as road and brakes tilt it.

    Args:
        ego: its motion.
        time_s: when.
        height: the ground's, None where it is flat.
        tilt_rad: how far the body leans besides, nose down and to the left, swaying about that.
    """
    x, y, heading = ego.pose(time_s)
    if height is None and tilt_rad == 0:
        return [x, y, 0.0], yaw_quaternion(heading)
    pitch_lean, roll_lean = _lean(time_s, tilt_rad)
    if height is None:
        return [x, y, 0.0], _quaternion(heading, pitch_lean, roll_lean)
    rear = np.array([x, y])
    front = rear + EGO_WHEELBASE_M * direction(heading)
    aside = _TRACK_M / 2 * direction(heading + np.pi / 2)
    z = float(height(rear))
    climb = float(np.arcsin((float(height(front)) - z) / EGO_WHEELBASE_M))
    bank = float(np.arcsin(float(height(rear + aside) - height(rear - aside)) / _TRACK_M))
    pitch = -climb - _DIVE_RAD_PER_M_S2 * ego.acceleration(time_s)
    return [x, y, z], _quaternion(heading, pitch + pitch_lean, bank + roll_lean)


def _lean(time_s: float, tilt_rad: float) -> tuple[float, float]:
    """Pitch and roll of a body that is loaded unevenly and sways."""
    sways = [1 + _SWAY_SHARE * float(np.sin(2 * np.pi * time_s / period_s)) for period_s in _SWAY_S]
    return tilt_rad * sways[0], -_ROLL_SHARE * tilt_rad * sways[1]


def _quaternion(yaw: float, pitch: float, roll: float) -> list[float]:
    """Turned about x by roll, then about y by pitch, then about z by yaw (positive pitch: nose down)."""
    (cz, sz), (cy, sy), (cx, sx) = (
        (float(np.cos(angle / 2)), float(np.sin(angle / 2))) for angle in (yaw, pitch, roll)
    )
    return [
        cz * cy * cx + sz * sy * sx,
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
    ]
