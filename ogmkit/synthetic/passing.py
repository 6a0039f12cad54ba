"""How drivers pass what stands in their way: how far they swerve, and how fast they are meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.synthetic.curves import Path
from ogmkit.synthetic.obstacles import GAP_M, KERB_GAP_M, Obstacle
from ogmkit.typing import FloatArray, IntArray

_LEAST_GAP_M = 0.15
_NEAR_M = 8.0
_PARALLEL = 0.8  # cosine of the angle between an obstacle and a way that may have to lead round it
_LEVEL_M = 1.0  # the full swerve is reached so long before an obstacle, and kept so long behind it
_OUT_M, _OUT_SHARE = 4.5, 3.25  # length of the way out: so much, and so much a metre of swerve
_BACK_SHARE = 0.8  # of that is the way back
_SLOW_BEFORE_M = 5.0
_LATERAL_M_S2 = 3.0


@dataclass(frozen=True, eq=False)
class Passing:
    """How a driver leaves his usual line.

    Attributes:
        left_m: (N,) how far left of it he keeps at each of the path's points.
        limits_m_s: (N,) how fast he drives there at most; infinite where nothing hinders him.
    """

    left_m: FloatArray
    limits_m_s: FloatArray


def plan_passing(
    path: Path, obstacles: Sequence[Obstacle], width_m: float, cruise_m_s: float
) -> Passing | None:
    """How to pass all obstacles near a path; None where a vehicle is too wide for it.

    Args:
        path: the usual line.
        obstacles: what stands about.
        width_m: of the vehicle.
        cruise_m_s: its speed on a free road.
    """
    left_m, limits_m_s = np.zeros(len(path.points)), np.full(len(path.points), np.inf)
    for obstacle in obstacles:
        for index in _meetings(path, obstacle):
            swerve_m = _swerve_m(path, int(index), obstacle, width_m)
            if swerve_m is None:
                return None
            behind_m = path.distances - path.distances[index]
            half_m = obstacle.look.size_wlh[1] / 2
            left_m += swerve_m * _bump(behind_m, half_m + _LEVEL_M, _OUT_M + _OUT_SHARE * abs(swerve_m))
            if swerve_m:
                beside = (behind_m > -half_m - _SLOW_BEFORE_M) & (behind_m < half_m + _LEVEL_M)
                slow_m_s = cruise_m_s * _slowness(swerve_m)
                limits_m_s[beside] = np.minimum(limits_m_s[beside], slow_m_s)
    bends = np.abs(path.offset(left_m).curvatures)
    swerving = np.abs(left_m) > 1e-3
    bend_limits = np.sqrt(_LATERAL_M_S2 / np.maximum(bends[swerving], 1e-6))
    limits_m_s[swerving] = np.minimum(limits_m_s[swerving], bend_limits)
    return Passing(left_m, limits_m_s)


def _meetings(path: Path, obstacle: Obstacle) -> IntArray:
    """Indices of the path's points where it leads past an obstacle; more than one where it comes again."""
    x, y, heading = obstacle.place.pose(0.0)
    away_m = np.linalg.norm(path.points - np.array([x, y]), axis=1)
    parallel = np.abs(np.cos(path.headings - heading)) > _PARALLEL
    near = np.flatnonzero((away_m < _NEAR_M) & parallel)
    runs = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
    return np.array([run[np.argmin(away_m[run])] for run in runs if len(run)], dtype=np.int64)


def _swerve_m(path: Path, index: int, obstacle: Obstacle, width_m: float) -> float | None:
    """How far left a vehicle must keep at an obstacle, 0 where it is not in the way, None without a way."""
    x, y, heading = obstacle.place.pose(0.0)
    normal = np.array([-np.sin(path.headings[index]), np.cos(path.headings[index])])
    obstacle_m = float(normal @ (np.array([x, y]) - path.points[index]))
    is_along = np.cos(path.headings[index] - heading) > 0
    edges_m = (obstacle.left_m, obstacle.right_m) if is_along else (obstacle.right_m, obstacle.left_m)
    touching_m = (obstacle.look.size_wlh[0] + width_m) / 2
    if abs(obstacle_m) >= touching_m + GAP_M:
        return 0.0
    side, edge_m = (1, edges_m[0]) if obstacle_m < 0 else (-1, edges_m[1])
    gap_m = min(GAP_M, edge_m - KERB_GAP_M - width_m / 2 - touching_m)
    if gap_m < _LEAST_GAP_M:
        return None
    swerve_m = side * (touching_m + gap_m) + obstacle_m
    return swerve_m if side * swerve_m > 0 else 0.0


def _bump(behind_m: FloatArray, level_m: float, out_m: float) -> FloatArray:
    """0 far off, 1 within `level_m`, between them quintic blends of least jerk."""
    out = np.clip((behind_m + level_m + out_m) / out_m, 0.0, 1.0)
    back = np.clip((level_m - behind_m) / (_BACK_SHARE * out_m) + 1, 0.0, 1.0)
    way = np.minimum(out, back)
    bump: FloatArray = way**3 * (10 - 15 * way + 6 * way**2)
    return bump


def _slowness(swerve_m: float) -> float:
    """Share of the usual speed: the further an obstacle reaches into the way, the slower."""
    return float(np.clip(0.95 - 0.17 * abs(swerve_m), 0.55, 0.95))
