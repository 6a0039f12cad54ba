"""Simulates drivers: they follow each other, brake for bends, and take turns at junctions.

Car following is the intelligent driver model (Treiber, Hennecke, Helbing: Congested traffic states in
empirical observations and microscopic simulations, 2000). Whoever may enter a junction holds his way through
it; others whose ways cross it wait at their stop lines.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ogmkit.synthetic.drivers import Blockade, Driver
from ogmkit.synthetic.streets import STOP_M, Network
from ogmkit.typing import FloatArray

STEP_S = 0.1
_LOOK_AHEAD_M = 70.0
_HEADWAY_S = 1.3
_STANDSTILL_M = 2.5
_ACCELERATION_M_S2 = 1.6
_COMFORT_M_S2 = 2.0
_HARDEST_M_S2 = 6.0
_BRAKING_M_S2 = 5.5  # of those who brake suddenly
_BRAKING_LAG_S = 0.4
_CLEAR_M = 3.0  # ways through a junction that come closer than this exclude each other
_FORK_M = 8.0  # after this much of their ways, two that began alike are apart
_ROOM_M = 5.0
_WAIT_M = STOP_M + 0.8 - _STANDSTILL_M + 0.6  # the model itself keeps its distance from the stop line


@dataclass(eq=False)
class _State:
    """A driver under way."""

    driver: Driver
    limits_m_s: FloatArray
    front_m: float
    speed_m_s: float
    paused_s: float = 0.0
    held: set[int] = field(default_factory=set)  # positions in the route of turns that he may drive


class Simulation:
    """All drivers of a scene, step by step."""

    def __init__(self, network: Network, drivers: Sequence[Driver], blockades: Sequence[Blockade]) -> None:
        self._network = network
        self._blockades = blockades
        self._states = [_start(driver) for driver in drivers]
        self._conflicts: dict[tuple[int, int], bool] = {}
        self._occupancy: dict[int, list[tuple[float, float, int]]] = {}

    def run(self, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Fronts in metres and speeds, (D, T) each, at evenly spaced times `STEP_S` apart."""
        fronts, speeds = np.zeros((2, len(self._states), len(times_s)))
        for index, time_s in enumerate(times_s):
            fronts[:, index] = [state.front_m for state in self._states]
            speeds[:, index] = [state.speed_m_s for state in self._states]
            self._occupy()
            accelerations = [self._acceleration(number, float(time_s)) for number in range(len(self._states))]
            for state, acceleration in zip(self._states, accelerations, strict=True):
                _advance(state, acceleration)
        return fronts, speeds

    def _occupy(self) -> None:
        """Note which stretch of which lane each vehicle covers: (rear, front, driver)."""
        self._occupancy = {}
        for number, state in enumerate(self._states):
            route, rear_m = state.driver.route, state.front_m - state.driver.length_m
            for position in range(route.index_at(rear_m), route.index_at(state.front_m) + 1):
                start_m = float(route.starts_m[position])
                covered = (rear_m - start_m, state.front_m - start_m, number)
                self._occupancy.setdefault(route.lanes[position], []).append(covered)
            state.held = {position for position in state.held if rear_m < float(route.starts_m[position + 1])}

    def _acceleration(self, number: int, time_s: float) -> float:
        state = self._states[number]
        obstacles = [self._leader(number), (self._to_stop_m(number, time_s), 0.0)]
        if state.paused_s < state.driver.pause_s:
            obstacles.append((state.driver.pause_m - state.front_m, 0.0))
        limit = float(np.interp(state.front_m, state.driver.route.path.distances, state.limits_m_s))
        free = max(1 - (state.speed_m_s / limit) ** 4, -_COMFORT_M_S2 / _ACCELERATION_M_S2)
        demands = [_ACCELERATION_M_S2 * free]
        for gap_m, speed_m_s in obstacles:
            if gap_m < _LOOK_AHEAD_M:
                demands.append(_following(state.speed_m_s, gap_m, speed_m_s, free))
        demands += [
            max((braking.speed_m_s - state.speed_m_s) / _BRAKING_LAG_S, -_BRAKING_M_S2)
            for braking in state.driver.brakings
            if braking.start_s <= time_s <= braking.end_s
        ]
        return max(min(demands), -_HARDEST_M_S2)

    def _leader(self, number: int) -> tuple[float, float]:
        """Gap to the next vehicle on the route, and its speed; infinite where there is none near."""
        state = self._states[number]
        route = state.driver.route
        nearest = (np.inf, 0.0)
        for position in range(route.index_at(state.front_m), len(route.lanes)):
            start_m = float(route.starts_m[position])
            if start_m - state.front_m > _LOOK_AHEAD_M:
                break
            for rear_m, front_m, other in self._on(route.lanes[position]):
                ahead_m = start_m + front_m - state.front_m
                if other != number and (ahead_m, other) > (0.0, number):
                    nearest = min(nearest, (start_m + rear_m - state.front_m, self._states[other].speed_m_s))
        return nearest

    def _on(self, lane: int) -> list[tuple[float, float, int]]:
        """Who is on a lane; on a turn also those not yet clear of it who take another from the same lane."""
        found = list(self._occupancy.get(lane, ()))
        if self._network.lanes[lane].road < 0:
            before = self._network.preceding[lane][0]
            for sibling in self._network.following[before]:
                if sibling != lane:
                    found += [item for item in self._occupancy.get(sibling, ()) if item[0] < _FORK_M]
        return found

    def _to_stop_m(self, number: int, time_s: float) -> float:
        """Distance to the stop line where the driver must wait; infinite where the driver may continue."""
        state = self._states[number]
        route = state.driver.route
        for position in range(route.index_at(state.front_m), len(route.lanes)):
            distance_m = float(route.starts_m[position]) - _WAIT_M - state.front_m
            braking_m = state.speed_m_s**2 / (2 * _COMFORT_M_S2)
            if distance_m > braking_m + 12:
                return np.inf
            if self._network.lanes[route.lanes[position]].road >= 0 or position in state.held:
                continue
            if distance_m < -1.0 or self._may_enter(number, position, time_s):
                state.held.add(position)
                continue
            return distance_m
        return np.inf

    def _may_enter(self, number: int, position: int, time_s: float) -> bool:
        route = self._states[number].driver.route
        if position == 0 or position + 1 >= len(route.lanes):
            return True
        way = route.lanes[position]
        for lane, arriving in ((route.lanes[position - 1], True), (route.lanes[position + 1], False)):
            if self._is_blocked(lane, arriving, time_s):
                return False
        for other, state in enumerate(self._states):
            held = [state.driver.route.lanes[held] for held in state.held]
            if other != number and any(self._conflict(way, held_way) for held_way in held):
                return False
        needed_m = self._states[number].driver.length_m + _ROOM_M
        return all(
            rear_m > needed_m or self._states[other].speed_m_s > 2.0
            for rear_m, _, other in self._on(route.lanes[position + 1])
        )

    def _is_blocked(self, lane: int, arriving: bool, time_s: float) -> bool:
        road = self._network.lanes[lane].road
        forward = self._network.lanes[lane].side == self._network.traffic_side
        return any(
            (blockade.road, blockade.at_end) == (road, forward == arriving)
            and blockade.start_s <= time_s <= blockade.end_s
            for blockade in self._blockades
        )

    def _conflict(self, way: int, other: int) -> bool:
        """Whether two ways through junctions exclude each other; those that begin alike queue instead."""
        key = (min(way, other), max(way, other))
        if key not in self._conflicts:
            one, two = self._network.lanes[way], self._network.lanes[other]
            apart = (
                one.junction != two.junction or self._network.preceding[way] == self._network.preceding[other]
            )
            gaps = one.path.points[:, None] - two.path.points[None]
            self._conflicts[key] = not apart and bool(np.sum(gaps**2, axis=-1).min() < _CLEAR_M**2)
        return self._conflicts[key]


def _start(driver: Driver) -> _State:
    passing = driver.passing
    wish_m_s = driver.cruise_m_s if passing is None else np.minimum(passing.limits_m_s, driver.cruise_m_s)
    limits = driver.route.speed_limits(wish_m_s)
    speed = float(np.interp(driver.start_m, driver.route.path.distances, limits))
    return _State(driver, limits, driver.start_m, 0.8 * speed)


def _following(speed_m_s: float, gap_m: float, leader_m_s: float, free: float) -> float:
    """The intelligent driver model's acceleration behind a leader."""
    closing = speed_m_s * (speed_m_s - leader_m_s) / (2 * np.sqrt(_ACCELERATION_M_S2 * _COMFORT_M_S2))
    wanted_m = _STANDSTILL_M + max(0.0, speed_m_s * _HEADWAY_S + closing)
    return float(_ACCELERATION_M_S2 * (free - (wanted_m / max(gap_m, 0.1)) ** 2))


def _advance(state: _State, acceleration_m_s2: float) -> None:
    speed = max(0.0, state.speed_m_s + acceleration_m_s2 * STEP_S)
    state.front_m += (state.speed_m_s + speed) / 2 * STEP_S
    state.speed_m_s = speed
    if speed < 0.2 and state.front_m > state.driver.pause_m - 2 * _STANDSTILL_M:
        state.paused_s += STEP_S
