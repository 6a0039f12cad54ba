"""Car parks beside the roads: two rows of stalls, an island between them, a driveway."""

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from ogmkit.synthetic.curves import direction
from ogmkit.synthetic.streets import Network
from ogmkit.typing import FloatArray

_STALL_M = (2.7, 5.4)
_AISLE_M = 6.0
_ISLAND_M = 2.6
_DRIVEWAY_M = 6.5
_VERGE_M = 2.0
_DEPTH_M = 2 * (_STALL_M[1] + _AISLE_M) + _ISLAND_M
_PER_MAP = 3


@dataclass(frozen=True, eq=False)
class CarPark:
    """One car park.

    Attributes:
        area: the paved rectangle.
        driveway: its link to the road, overlapping both.
        island: planted strip in its middle.
        stalls: (S, 3) x, y and heading of cars parked in it.
        stall_lines: (L, 2, 2) painted lines.
        heading_rad: of its long side.
    """

    area: Polygon
    driveway: Polygon
    island: Polygon
    stalls: FloatArray
    stall_lines: FloatArray
    heading_rad: float


def place_car_parks(random: np.random.Generator, network: Network) -> tuple[CarPark, ...]:
    """Put car parks beside straight enough roads, clear of all others."""
    placed: list[CarPark] = []
    for index in random.permutation(len(network.roads)):
        side = int(random.choice([-1, 1]))
        stalls_per_row = int(random.integers(8, 14))
        for candidate_side in (side, -side):
            if len(placed) == _PER_MAP:
                break
            candidate = _car_park(network, int(index), candidate_side, stalls_per_row)
            if _is_clear(candidate, network, placed):
                placed.append(candidate)
                break
    return tuple(placed)


def _car_park(network: Network, index: int, side: int, stalls_per_row: int) -> CarPark:
    road = network.roads[index]
    middle_m = road.centre.length / 2
    heading = float(road.centre.heading(middle_m))
    kerb_m = float(np.interp(middle_m, road.centre.distances, road.left_m if side > 0 else road.right_m))
    to_edge_m = kerb_m + road.section.walkway_m + _VERGE_M
    along, across = direction(heading), side * direction(heading + np.pi / 2)
    origin = road.centre.at(middle_m)

    def place(points: FloatArray) -> FloatArray:
        """Global points of (..., 2): metres along the road, metres from the car park's near edge."""
        result: FloatArray = origin + points[..., :1] * along + (to_edge_m + points[..., 1:]) * across
        return result

    half_m = stalls_per_row * _STALL_M[0] / 2 + _AISLE_M
    island_half_m = half_m - _AISLE_M
    island_near_m = (_DEPTH_M - _ISLAND_M) / 2
    stall_x = (np.arange(stalls_per_row, dtype=np.float64) - (stalls_per_row - 1) / 2) * _STALL_M[0]
    entrance = np.abs(stall_x) < _DRIVEWAY_M / 2 + _STALL_M[0] / 2
    inward = float(np.arctan2(across[1], across[0]))
    near = np.stack([stall_x[~entrance], np.full((~entrance).sum(), _STALL_M[1] / 2)], -1)
    far = np.stack([stall_x, np.full(stalls_per_row, _DEPTH_M - _STALL_M[1] / 2)], -1)
    return CarPark(
        area=Polygon(place(_rectangle(-half_m, 0.0, half_m, _DEPTH_M))),
        driveway=Polygon(place(_rectangle(-_DRIVEWAY_M / 2, -to_edge_m + kerb_m - 2, _DRIVEWAY_M / 2, 1))),
        island=Polygon(
            place(_rectangle(-island_half_m, island_near_m, island_half_m, island_near_m + _ISLAND_M))
        ),
        stalls=np.concatenate([_stalls(place(near), inward + np.pi), _stalls(place(far), inward)]),
        stall_lines=place(_stall_lines(stall_x[~entrance], stall_x)),
        heading_rad=heading,
    )


def _stalls(middles: FloatArray, heading_rad: float) -> FloatArray:
    """(N, 3) x, y, heading of stalls whose (N, 2) middles are given, all facing one way."""
    return np.column_stack([middles, np.full(len(middles), heading_rad)])


def _stall_lines(near_x: FloatArray, far_x: FloatArray) -> FloatArray:
    """(L, 2, 2) ends of the lines beside stalls of the near and far row, whose middles are given, metres."""
    lines = [
        [[x, y], [x, y + _STALL_M[1]]]
        for y, row in ((0.0, near_x), (_DEPTH_M - _STALL_M[1], far_x))
        for x in np.unique(np.round(np.concatenate([row - _STALL_M[0] / 2, row + _STALL_M[0] / 2]), 6))
    ]
    return np.array(lines)


def _rectangle(x_min: float, y_min: float, x_max: float, y_max: float) -> FloatArray:
    return np.array([[x_min, y_min], [x_max, y_min], [x_max, y_max], [x_min, y_max]])


def _is_clear(candidate: CarPark, network: Network, placed: list[CarPark]) -> bool:
    """Whether the rectangle keeps its distance from roads, walkways and the other car parks."""
    centre = np.array(candidate.area.centroid.coords[0])
    radius_m = float(np.linalg.norm(np.array(candidate.area.exterior.coords) - centre, axis=1).max())
    if any(candidate.area.distance(other.area) < 8 for other in placed):
        return False
    for road in network.roads:
        margin_m = max(road.left_m.max(), road.right_m.max()) + road.section.walkway_m + 0.5
        near = road.centre.points[np.linalg.norm(road.centre.points - centre, axis=1) < radius_m + margin_m]
        if len(near) and _distance_to_rectangle(candidate, near).min() < margin_m - 2.0:
            return False
    return True


def _distance_to_rectangle(car_park: CarPark, points: FloatArray) -> FloatArray:
    corners = np.array(car_park.area.exterior.coords)[:4]
    middle = corners.mean(0)
    sides = np.stack([corners[1] - corners[0], corners[3] - corners[0]])
    lengths = np.linalg.norm(sides, axis=1)
    local = (points - middle) @ (sides / lengths[:, None]).T
    outside: FloatArray = np.linalg.norm(np.maximum(np.abs(local) - lengths / 2, 0), axis=1)
    return outside
