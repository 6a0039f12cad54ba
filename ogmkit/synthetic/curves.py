"""Smooth plane curves: polylines measured by arc length, and how to make them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ogmkit.typing import FloatArray

STEP_M = 0.5
"""Spacing of a path's points: on a 15 m bend the chord then strays by 2 mm."""


@dataclass(frozen=True, eq=False)
class Path:
    """A polyline in the order of travel.

    Attributes:
        points: (N, 2) float64, metres, N ≥ 2, no two neighbours alike.
    """

    points: FloatArray

    @cached_property
    def distances(self) -> FloatArray:
        """(N,) distance of each point from the start along the path, metres."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Metres from the first point to the last."""
        return float(self.distances[-1])

    @cached_property
    def headings(self) -> FloatArray:
        """(N,) direction of travel at each point, radians, without jumps of 2π."""
        tangents = np.gradient(
            self.points, self.distances, axis=0, edge_order=2 if len(self.points) > 2 else 1
        )
        return np.unwrap(np.arctan2(tangents[:, 1], tangents[:, 0]))

    @cached_property
    def curvatures(self) -> FloatArray:
        """(N,) signed curvature at each point, 1/m, positive to the left."""
        curvature: FloatArray = np.gradient(self.headings, self.distances)
        return curvature

    def at(self, distance_m: FloatArray | float) -> FloatArray:
        """Points (..., 2) at (...) distances; beyond the ends the path continues straight."""
        s = np.asarray(distance_m, dtype=np.float64)
        inside = np.clip(s, 0.0, self.length)
        on_path = np.stack([np.interp(inside, self.distances, self.points[:, axis]) for axis in (0, 1)], -1)
        heading = self.heading(inside)
        ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        result: FloatArray = on_path + (s - inside)[..., None] * ahead
        return result

    def heading(self, distance_m: FloatArray | float) -> FloatArray:
        """Direction of travel (...) at (...) distances, radians."""
        return np.asarray(np.interp(distance_m, self.distances, self.headings))

    def offset(self, left_m: FloatArray | float) -> "Path":
        """The parallel path to the left (right where negative): a number, or (N,) at each point."""
        normals = np.stack([-np.sin(self.headings), np.cos(self.headings)], axis=-1)
        return Path(self.points + np.broadcast_to(left_m, self.distances.shape)[:, None] * normals)

    def part(self, start_m: float, end_m: float) -> "Path":
        """The path between two distances, points newly spread."""
        count = max(2, int(np.ceil((end_m - start_m) / STEP_M)) + 1)
        return Path(self.at(np.linspace(start_m, end_m, count)))

    def reversed(self) -> "Path":
        """The same path the other way."""
        return Path(self.points[::-1].copy())

    def simplified(self, tolerance_m: float = 0.08) -> "Path":
        """The path with fewer points, nowhere further off than the tolerance (Douglas & Peucker, 1973)."""
        keep = np.zeros(len(self.points), dtype=np.bool_)
        keep[[0, -1]] = True
        spans = [(0, len(self.points) - 1)]
        while spans:
            first, last = spans.pop()
            chord = self.points[last] - self.points[first]
            away = self.points[first + 1 : last] - self.points[first]
            off_m = np.abs(chord[0] * away[:, 1] - chord[1] * away[:, 0]) / np.linalg.norm(chord)
            if len(off_m) and off_m.max() > tolerance_m:
                middle = first + 1 + int(np.argmax(off_m))
                keep[middle] = True
                spans += [(first, middle), (middle, last)]
        return Path(self.points[keep])


def even_path(points: FloatArray) -> Path:
    """A path through densely given (N, 2) points, resampled every `STEP_M`."""
    rough = Path(points)
    return rough.part(0.0, rough.length)


def hermite(start: FloatArray, end: FloatArray, start_tangent: FloatArray, end_tangent: FloatArray) -> Path:
    """Cubic Hermite curve between two (2,) points with given (2,) derivatives."""
    t = np.linspace(0.0, 1.0, 201)[:, None]
    points = (
        (2 * t**3 - 3 * t**2 + 1) * start
        + (t**3 - 2 * t**2 + t) * start_tangent
        + (3 * t**2 - 2 * t**3) * end
        + (t**3 - t**2) * end_tangent
    )
    return even_path(points)


def turn(start: FloatArray, start_heading: float, end: FloatArray, end_heading: float) -> Path:
    """A smooth way from one pose to another, near a circle's arc where one fits."""
    # A quarter circle's Bézier handle is 0.39 of the chord (0.5523 / √2); a derivative is three handles.
    reach_m = 3 * 0.39 * float(np.linalg.norm(end - start))
    return hermite(start, end, reach_m * direction(start_heading), reach_m * direction(end_heading))


def direction(heading_rad: float) -> FloatArray:
    """(2,) unit vector that points along a heading."""
    return np.array([np.cos(heading_rad), np.sin(heading_rad)])


def joined(paths: Sequence[Path]) -> Path:
    """Paths that follow each other as one; shared end points appear once."""
    parts = [paths[0].points, *(path.points[1:] for path in paths[1:])]
    return Path(np.concatenate(parts))
