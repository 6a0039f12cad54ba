"""How things move on the plane: standing, driving along a route, walking."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ogmkit.synthetic.catalogue import Look
from ogmkit.synthetic.curves import Path
from ogmkit.typing import FloatArray


class Motion(Protocol):
    """Where something is at any time; seconds count from the scene's first moment."""

    def pose(self, time_s: float) -> tuple[float, float, float]:
        """x, y and heading."""

    def speed(self, time_s: float) -> float:
        """Metres a second, never negative."""


@dataclass(frozen=True)
class Standing:
    """Never moves."""

    x: float
    y: float
    heading_rad: float

    def pose(self, time_s: float) -> tuple[float, float, float]:
        """Always the same."""
        return self.x, self.y, self.heading_rad

    def speed(self, time_s: float) -> float:
        """Zero."""
        return 0.0


@dataclass(frozen=True, eq=False)
class Driving:
    """Two axles that follow a path, so that the body cuts corners as real ones do.

    Attributes:
        path: what the axles follow.
        times_s: (T,) when the simulation looked, evenly spaced.
        fronts_m: (T,) distance of the front bumper along the path.
        speeds_m_s: (T,).
        rear_axle_m: from the front bumper back to the rear axle.
        wheelbase_m: between the axles.
        origin_m: from the rear axle forward to the body's origin.
    """

    path: Path
    times_s: FloatArray
    fronts_m: FloatArray
    speeds_m_s: FloatArray
    rear_axle_m: float
    wheelbase_m: float
    origin_m: float

    def pose(self, time_s: float) -> tuple[float, float, float]:
        """Smooth between the simulation's steps."""
        rear_m = self._front_m(time_s) - self.rear_axle_m
        rear, front = self.path.at(np.array([rear_m, rear_m + self.wheelbase_m]))
        ahead = (front - rear) / np.linalg.norm(front - rear)
        x, y = rear + self.origin_m * ahead
        return float(x), float(y), float(np.arctan2(ahead[1], ahead[0]))

    def speed(self, time_s: float) -> float:
        """Of the front bumper along the path."""
        return float(np.interp(time_s, self.times_s, self.speeds_m_s))

    def acceleration(self, time_s: float) -> float:
        """Along the path, m/s², smoothed over half a second as springs do."""
        return (self.speed(time_s + 0.25) - self.speed(time_s - 0.25)) / 0.5

    def _front_m(self, time_s: float) -> float:
        """Cubic Hermite interpolation of the simulated distances and speeds."""
        step_s = float(self.times_s[1] - self.times_s[0])
        index = int(np.clip((time_s - self.times_s[0]) / step_s, 0, len(self.times_s) - 2))
        t = (time_s - float(self.times_s[index])) / step_s
        start, end = self.fronts_m[index : index + 2]
        start_slope, end_slope = step_s * self.speeds_m_s[index : index + 2]
        return float(
            (2 * t**3 - 3 * t**2 + 1) * start
            + (t**3 - 2 * t**2 + t) * start_slope
            + (3 * t**2 - 2 * t**3) * end
            + (t**3 - t**2) * end_slope
        )


@dataclass(frozen=True, eq=False)
class Strolling:
    """To and fro along a path at constant speed."""

    path: Path
    start_m: float
    speed_m_s: float

    def pose(self, time_s: float) -> tuple[float, float, float]:
        """Turns round at the path's ends."""
        lap_m = (self.start_m + self.speed_m_s * time_s) % (2 * self.path.length)
        there = lap_m <= self.path.length
        distance_m = lap_m if there else 2 * self.path.length - lap_m
        x, y = self.path.at(distance_m)
        heading = float(self.path.heading(distance_m)) + (0.0 if there else np.pi)
        return float(x), float(y), heading

    def speed(self, time_s: float) -> float:
        """Constant."""
        return self.speed_m_s


@dataclass(frozen=True, eq=False)
class Crossing:
    """Waits at one end of a path, walks to the other, stays there."""

    path: Path
    begin_s: float
    speed_m_s: float

    @property
    def end_s(self) -> float:
        """When the other end is reached."""
        return self.begin_s + self.path.length / self.speed_m_s

    def pose(self, time_s: float) -> tuple[float, float, float]:
        """Faces the other side all the time."""
        distance_m = np.clip(self.speed_m_s * (time_s - self.begin_s), 0, self.path.length)
        x, y = self.path.at(distance_m)
        return float(x), float(y), float(self.path.heading(distance_m))

    def speed(self, time_s: float) -> float:
        """Zero at both ends."""
        return self.speed_m_s if self.begin_s < time_s < self.end_s else 0.0


@dataclass(frozen=True, eq=False)
class Actor:
    """Something that stands or moves on the ground and is annotated.

    Attributes:
        look: what it is.
        motion: where it is; the origin is the middle of its ground face.
        driver: which simulated driver moves it, −1 for none.
    """

    look: Look
    motion: Motion
    driver: int = -1
