"""Streets of a synthetic town as records: roads with their cross-sections, lanes, turns."""

from dataclasses import dataclass, field

import numpy as np

from ogmkit.synthetic.curves import Path
from ogmkit.typing import FloatArray

CROSSING_M = 3.0
"""Width of a pedestrian crossing, which begins where the junction ends."""
STOP_M = 5.5
"""Distance of the stop line from the junction."""
SHOULDER_M = 0.3
"""From the outer edge of the outermost lane to the kerb, where nothing may be parked."""
PARKING_M = 2.5
"""Width of a parking strip."""
CORNER_M = 6.0
"""Radius of kerbs at junctions."""


@dataclass(frozen=True)
class CrossSection:
    """What lies side by side along a street, metres.

    Attributes:
        lanes: lanes in each direction.
        lane_m: width of a lane.
        median_m: width of the island between the directions, 0 for none.
        walkway_m: width of the walkways.
    """

    lanes: int
    lane_m: float
    median_m: float
    walkway_m: float

    @property
    def half_m(self) -> float:
        """From the middle to the outer edge of the outermost lane."""
        return self.median_m / 2 + self.lanes * self.lane_m

    @property
    def lane_edges_m(self) -> FloatArray:
        """(lanes + 1,) from the middle to the edges of the lanes of one direction, rising."""
        return np.asarray(self.median_m / 2 + self.lane_m * np.arange(self.lanes + 1), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Road:
    """A street between two junctions, without the junctions themselves.

    Attributes:
        centre: its middle line, from junction `ends[0]` to `ends[1]`.
        section: its cross-section.
        ends: indices of the junctions.
        left_m, right_m: (N,) distance of the kerbs from each point of `centre`: wider where cars may park.
        bays: for the left and the right side, stretches (start, end) of `centre` with a full parking strip.
    """

    centre: Path
    section: CrossSection
    ends: tuple[int, int]
    left_m: FloatArray
    right_m: FloatArray
    bays: tuple[tuple[tuple[float, float], ...], tuple[tuple[float, float], ...]]


@dataclass(frozen=True, eq=False)
class Lane:
    """A lane of a road, or a turn through a junction, in its direction of travel.

    Attributes:
        path: its middle line.
        width_m: its width.
        road: index of the road, −1 for a turn.
        origin: index of the junction that it comes from (a turn: the one it lies in).
        junction: index of the junction that it leads to (a turn: the one it lies in).
        rank: 0 beside the middle of the road, rising outward.
        side: +1 where the lane lies left of the road's middle line, −1 right; 0 for a turn.
    """

    path: Path
    width_m: float
    road: int
    origin: int
    junction: int
    rank: int
    side: int


@dataclass(frozen=True, eq=False)
class Network:
    """Streets of one town.

    Attributes:
        junctions: (J, 2) their centres.
        roads: the roads.
        lanes: lanes of roads first, then turns.
        following: for each lane, the lanes that continue it.
        traffic_side: +1 where traffic keeps left, −1 where it keeps right.
    """

    junctions: FloatArray
    roads: tuple[Road, ...]
    lanes: tuple[Lane, ...]
    following: tuple[tuple[int, ...], ...]
    traffic_side: int
    preceding: tuple[tuple[int, ...], ...] = field(init=False)

    def __post_init__(self) -> None:
        before: list[list[int]] = [[] for _ in self.lanes]
        for lane, followers in enumerate(self.following):
            for follower in followers:
                before[follower].append(lane)
        object.__setattr__(self, "preceding", tuple(tuple(lanes) for lanes in before))
