"""Who drives in a scene: the ego, somebody ahead of it, and the rest of the traffic."""

import numpy as np

from ogmkit.synthetic.catalogue import EGO_SIZE_WLH, Look, draw_look
from ogmkit.synthetic.drivers import Braking, Driver
from ogmkit.synthetic.routes import Route, draw_route
from ogmkit.synthetic.streets import Network
from ogmkit.typing import FloatArray

_KINDS = (
    ("vehicle.bus.rigid",),
    ("vehicle.bus.bendy", "vehicle.bus.bendy"),
    ("vehicle.truck",),
    ("vehicle.truck", "vehicle.trailer"),
    ("vehicle.construction",),
    ("vehicle.motorcycle",),
    ("vehicle.bicycle",),
    ("vehicle.bicycle",),
    ("vehicle.emergency.police",),
    ("vehicle.emergency.ambulance",),
)
"""Parts of the less common vehicles, front to rear; every scene has one of each, and cars."""
_CAR = ("vehicle.car",)
_CARS = 14
_COUPLING_M = 0.7
_CRUISE_M_S = {"vehicle.bicycle": (3.5, 5.5), "vehicle.construction": (3.5, 6.0), "vehicle.bus": (6.5, 9.5)}
_CAR_CRUISE_M_S = (7.5, 12.0)
_GAP_M = 9.0
_LEADER_GAP_M = (14.0, 38.0)
_LEADER_HASTE = (0.65, 1.05)  # of the ego's cruising speed
_ODD_LEADER = 0.4
_BRAKER_GAP_M = (10.0, 18.0)
_BRAKER_HASTE = (0.85, 1.0)
_BRAKING_EVERY_S = (4.0, 7.0)
_BRAKING_S = (1.0, 2.5)
_EARLY = 0.4  # share of a lane in which the ego begins where it is to meet obstacles
_HALTING = 0.35
_HALT_M = (55.0, 130.0)  # from where the leader is five seconds before the scene begins
_NEAR_CARS, _NEAR_OTHERS = 0.4, 0.75  # shares of those who start near the ego's way
_AHEAD_M = 60.0
_REACH_M = 90.0
_TRIES = 60


def draw_drivers(
    random: np.random.Generator, network: Network, duration_s: float, *, incidents: bool = False
) -> list[Driver]:
    """All drivers of a scene; the first is the ego's.

    Args:
        random: source of choices.
        network: the streets.
        duration_s: how long the routes must last.
        incidents: whether a car goes just ahead of the ego all the time, and brakes suddenly now and then.
    """
    taken: dict[int, list[tuple[float, float]]] = {}
    drivers = [_draw_ego(random, network, duration_s, taken, _EARLY if incidents else 1.0)]
    kinds: list[tuple[str, ...]] = [*_KINDS, *[_CAR] * _CARS]
    if incidents:
        drivers.append(_draw_braker(random, duration_s, taken, drivers[0]))
    else:
        leader = kinds[random.integers(len(kinds))] if random.uniform() < _ODD_LEADER else _CAR
        drivers.append(_draw_leader(random, network, duration_s, taken, drivers[0], _parts(random, leader)))
    for kind in kinds:
        parts = _parts(random, kind)
        near_share = _NEAR_CARS if kind == _CAR else _NEAR_OTHERS
        near = (
            drivers[0].route.path.at(drivers[0].start_m + _AHEAD_M) if random.uniform() < near_share else None
        )
        place = _free_place(random, network, taken, _length_m(parts), near)
        if place is not None:
            lane, start_m = place
            cruise = _cruise_m_s(random, kind[0])
            route = draw_route(random, network, (lane,), start_m + cruise * duration_s + 60)
            drivers.append(_driver(network, route, start_m, cruise, parts))
    return drivers


def _draw_ego(
    random: np.random.Generator,
    network: Network,
    duration_s: float,
    taken: dict[int, list[tuple[float, float]]],
    early: float,
) -> Driver:
    """The ego, somewhere in the first part of a lane; `early` is that part's share of it."""
    ego = Look("vehicle.car", EGO_SIZE_WLH, (0.0, 0.0, 0.0))
    parts = ((ego, EGO_SIZE_WLH[1] / 2),)
    lane, place_m = _place(random, network, EGO_SIZE_WLH[1])
    start_m = max(early * place_m, EGO_SIZE_WLH[1] + 1)
    taken.setdefault(lane, []).append((start_m - EGO_SIZE_WLH[1], start_m))
    cruise = float(random.uniform(8.0, 11.5))
    route = draw_route(random, network, (lane,), start_m + cruise * duration_s + 160)
    return Driver(route, start_m, cruise, EGO_SIZE_WLH[1], parts)


def _draw_leader(
    random: np.random.Generator,
    network: Network,
    duration_s: float,
    taken: dict[int, list[tuple[float, float]]],
    ego: Driver,
    parts: tuple[tuple[Look, float], ...],
) -> Driver:
    """Somebody ahead of the ego who takes the same way for a while, perhaps slowly, perhaps with a halt."""
    length_m = _length_m(parts)
    start_m = ego.start_m + float(random.uniform(*_LEADER_GAP_M)) + length_m
    cruise = float(ego.cruise_m_s * random.uniform(*_LEADER_HASTE))
    shared = ego.route.lanes[: ego.route.index_at(start_m) + int(random.integers(1, 4))]
    route = draw_route(random, network, shared, start_m + cruise * duration_s + 60)
    _take(taken, route, start_m, length_m)
    halts = random.uniform() < _HALTING
    pause_m = start_m + float(random.uniform(*_HALT_M)) if halts else np.inf
    return _driver(network, route, start_m, cruise, parts, pause_m, float(random.uniform(2.0, 5.0)))


def _draw_braker(
    random: np.random.Generator, duration_s: float, taken: dict[int, list[tuple[float, float]]], ego: Driver
) -> Driver:
    """A car that goes all of the ego's way just ahead of it and brakes hard now and then."""
    parts = _parts(random, _CAR)
    length_m = _length_m(parts)
    start_m = ego.start_m + float(random.uniform(*_BRAKER_GAP_M)) + length_m
    cruise = float(ego.cruise_m_s * random.uniform(*_BRAKER_HASTE))
    _take(taken, ego.route, start_m, length_m)
    brakings = []
    time_s = float(random.uniform(0.0, _BRAKING_EVERY_S[1]))
    while time_s < duration_s:
        end_s = time_s + float(random.uniform(*_BRAKING_S))
        brakings.append(Braking(time_s, end_s, cruise / 3 if random.uniform() < 0.5 else 0.0))
        time_s += float(random.uniform(*_BRAKING_EVERY_S))
    return Driver(ego.route, start_m, cruise, length_m, parts, brakings=tuple(brakings))


def _take(taken: dict[int, list[tuple[float, float]]], route: Route, front_m: float, length_m: float) -> None:
    """Note where a vehicle is at first, on all lanes that it covers."""
    for position in range(route.index_at(front_m - length_m), route.index_at(front_m) + 1):
        lane_m = float(route.starts_m[position])
        spot = (front_m - length_m - lane_m, front_m - lane_m)
        taken.setdefault(route.lanes[position], []).append(spot)


def _driver(
    network: Network,
    route: Route,
    start_m: float,
    cruise_m_s: float,
    parts: tuple[tuple[Look, float], ...],
    pause_m: float = np.inf,
    pause_s: float = 0.0,
) -> Driver:
    category, size_wlh = parts[0][0].category, parts[0][0].size_wlh
    narrow = category in ("vehicle.bicycle", "vehicle.motorcycle")
    spare_m = network.lanes[route.lanes[0]].width_m / 2 - size_wlh[0] / 2 - 0.5
    left_m = network.traffic_side * spare_m if narrow else 0.0
    return Driver(route, start_m, cruise_m_s, _length_m(parts), parts, left_m, pause_m, pause_s)


def _parts(random: np.random.Generator, kind: tuple[str, ...]) -> tuple[tuple[Look, float], ...]:
    """Looks of a vehicle's parts and how far behind the front bumper their middles are."""
    parts = []
    rear_m = 0.0
    for category in kind:
        look = draw_look(random, category)
        parts.append((look, rear_m + look.size_wlh[1] / 2))
        rear_m += look.size_wlh[1] + _COUPLING_M
    return tuple(parts)


def _length_m(parts: tuple[tuple[Look, float], ...]) -> float:
    look, middle_m = parts[-1]
    return middle_m + look.size_wlh[1] / 2


def _cruise_m_s(random: np.random.Generator, category: str) -> float:
    for start, limits in _CRUISE_M_S.items():
        if category.startswith(start):
            return float(random.uniform(*limits))
    return float(random.uniform(*_CAR_CRUISE_M_S))


def _place(random: np.random.Generator, network: Network, length_m: float) -> tuple[int, float]:
    """A lane of a road and a place for a front bumper on it, with room behind and ahead."""
    roads = [index for index, lane in enumerate(network.lanes) if lane.road >= 0]
    lengths = np.array([network.lanes[index].path.length for index in roads])
    lane = int(random.choice(roads, p=lengths / lengths.sum()))
    return lane, float(random.uniform(length_m + 1, network.lanes[lane].path.length - 12))


def _free_place(
    random: np.random.Generator,
    network: Network,
    taken: dict[int, list[tuple[float, float]]],
    length_m: float,
    near: FloatArray | None,
) -> tuple[int, float] | None:
    """A place that nobody has taken, in reach of a point if one is given; None where none was found."""
    for _ in range(_TRIES):
        lane, front_m = _place(random, network, length_m)
        if near is not None and np.linalg.norm(network.lanes[lane].path.at(front_m) - near) > _REACH_M:
            continue
        rear_m = front_m - length_m
        others = taken.setdefault(lane, [])
        if all(rear_m - _GAP_M > front or front_m + _GAP_M < rear for rear, front in others):
            others.append((rear_m, front_m))
            return lane, front_m
    return None
