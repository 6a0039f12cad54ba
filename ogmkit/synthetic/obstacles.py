"""Vehicles that stand in the lanes which the ego drives: parked in the second row, or broken down."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ogmkit.synthetic.catalogue import EGO_SIZE_WLH, Look, draw_look
from ogmkit.synthetic.curves import direction
from ogmkit.synthetic.motion import Actor, Standing
from ogmkit.synthetic.routes import Route
from ogmkit.synthetic.streets import SHOULDER_M, Lane, Network, Road
from ogmkit.typing import FloatArray

GAP_M = 0.55
"""Between an obstacle and whoever passes it, where there is room."""
KERB_GAP_M = 0.1
_SHARES = {"vehicle.car": 0.68, "vehicle.truck": 0.16, "vehicle.emergency.ambulance": 0.16}
_FIRST_M = (10.0, 50.0)  # ahead of the ego's first place
_SPACING_M = (28.0, 45.0)
_FROM_JUNCTION_M = 24.0
_SEARCH_M = 3.0
_SWERVE_M = (1.0, 2.2)  # of the ego's
_LEAST_SWERVE_M = 0.8
_INTO_NEXT_LANE_M = 0.8
_ONCOMING_HALF_M = 1.0
_TURN_RAD = 0.03
_TRIES = 30


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A vehicle that stands in a lane.

    Attributes:
        look: what it is.
        place: where; it heads about as its lane does.
        left_m: from its middle to the left end of what can be driven on beside it.
        right_m: the same to the right.
    """

    look: Look
    place: Standing
    left_m: float
    right_m: float

    @property
    def actor(self) -> Actor:
        """What the scene holds of it."""
        return Actor(self.look, self.place)


@dataclass(frozen=True)
class _Room:
    """Distances from a lane's middle, metres, outward or inward (towards the road's middle).

    Attributes:
        edge_m: to where the ground may be driven on.
        stand_m: how far a standing vehicle may reach.
        swerve_m: how far the ego may swerve.
    """

    edge_m: float
    stand_m: float
    swerve_m: float


def draw_obstacles(
    random: np.random.Generator, network: Network, route: Route, start_m: float
) -> list[Obstacle]:
    """Obstacles along a route, from a start on, such that a car can pass each on one side."""
    obstacles = []
    for lane, along_m in _sites(random, network, route, start_m):
        for _ in range(_TRIES):
            obstacle = _draw(random, network, network.lanes[lane], along_m)
            if obstacle is not None:
                obstacles.append(obstacle)
                break
    return obstacles


def _sites(
    random: np.random.Generator, network: Network, route: Route, start_m: float
) -> Iterator[tuple[int, float]]:
    """Lanes and distances on them."""
    place_m = start_m + float(random.uniform(*_FIRST_M))
    while place_m < route.path.length:
        position = route.index_at(place_m)
        lane, along_m = route.lanes[position], place_m - float(route.starts_m[position])
        length_m = network.lanes[lane].path.length
        far_enough = _FROM_JUNCTION_M <= along_m <= length_m - _FROM_JUNCTION_M
        is_again = lane in route.lanes[:position]  # and has its obstacles already
        if network.lanes[lane].road >= 0 and far_enough and not is_again:
            yield lane, along_m
            place_m += float(random.uniform(*_SPACING_M))
        else:
            place_m += _SEARCH_M


def _draw(random: np.random.Generator, network: Network, lane: Lane, along_m: float) -> Obstacle | None:
    """An obstacle at a place, None where the one drawn does not fit."""
    outward, inward = _rooms(network.roads[lane.road], lane, along_m)
    is_outside = random.uniform() < 0.5
    here, free = (outward, inward) if is_outside else (inward, outward)
    look = draw_look(random, str(random.choice(list(_SHARES), p=list(_SHARES.values()))))
    swerve_m = float(random.uniform(*_SWERVE_M))
    if free.swerve_m < _LEAST_SWERVE_M:
        return None
    swerve_m = min(swerve_m, free.swerve_m)
    face_m = EGO_SIZE_WLH[0] / 2 + GAP_M - swerve_m
    if face_m + look.size_wlh[0] > here.stand_m:
        return None
    side = network.traffic_side if is_outside else -network.traffic_side  # +1 is left
    middle_m = face_m + look.size_wlh[0] / 2
    heading = float(lane.path.heading(along_m))
    x, y = lane.path.at(along_m) + side * middle_m * direction(heading + np.pi / 2)
    place = Standing(float(x), float(y), heading + float(random.normal(0.0, _TURN_RAD)))
    edges_m = (here.edge_m - middle_m, free.edge_m + middle_m)
    return Obstacle(look, place, *(edges_m if side > 0 else edges_m[::-1]))


def _rooms(road: Road, lane: Lane, along_m: float) -> tuple[_Room, _Room]:
    """Room outward and inward of a lane's middle."""
    section = road.section
    half_m = lane.width_m / 2
    ego_m = EGO_SIZE_WLH[0] / 2 + KERB_GAP_M
    middle_m = section.median_m / 2 + lane.rank * section.lane_m + half_m
    kerb_m = section.half_m + SHOULDER_M - middle_m
    if lane.rank + 1 < section.lanes:
        outward = _Room(kerb_m, half_m + _INTO_NEXT_LANE_M, _SWERVE_M[1])
    else:
        outward = _Room(kerb_m, _kerb_m(road, lane, along_m) - middle_m - KERB_GAP_M, kerb_m - ego_m)
    if lane.rank > 0:
        return outward, _Room(half_m + section.lane_m, half_m + _INTO_NEXT_LANE_M, _SWERVE_M[1])
    if section.median_m > 0:
        island_m = half_m + SHOULDER_M
        return outward, _Room(island_m, island_m - KERB_GAP_M, island_m - ego_m)
    beyond_m = section.lane_m - _ONCOMING_HALF_M - ego_m
    return outward, _Room(half_m + section.half_m, half_m + _INTO_NEXT_LANE_M, beyond_m)


def _kerb_m(road: Road, lane: Lane, along_m: float) -> float:
    """Distance from the road's middle to the kerb beside a lane, the least within a truck's length."""
    away_m: FloatArray = np.linalg.norm(road.centre.points - lane.path.at(along_m), axis=1)
    distances = road.centre.distances
    near = np.abs(distances - distances[np.argmin(away_m)]) < 5.0
    kerb_m = road.left_m if lane.side > 0 else road.right_m
    return float(kerb_m[near].min())
