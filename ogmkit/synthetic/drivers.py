"""Drivers as records: what they drive, where to, and what makes them stop."""

from dataclasses import dataclass

import numpy as np

from ogmkit.synthetic.catalogue import Look
from ogmkit.synthetic.passing import Passing
from ogmkit.synthetic.routes import Route


@dataclass(frozen=True)
class Braking:
    """A sudden slowing down.

    Attributes:
        start_s, end_s: from when to when.
        speed_m_s: down to which speed.
    """

    start_s: float
    end_s: float
    speed_m_s: float


@dataclass(frozen=True, eq=False)
class Driver:
    """One vehicle, possibly of several parts, and what its driver means to do.

    Attributes:
        route: where to.
        start_m: of the front bumper along the route.
        cruise_m_s: speed on a free straight road.
        length_m: from the front bumper to the rear of the last part.
        parts: what is drawn: a look and the distance from the front bumper to the part's middle.
        left_m: how far left of the lane's middle it keeps.
        pause_m: where on the route it stops for a while; infinite for nowhere.
        pause_s: for how long.
        passing: how he leaves his line for what stands there; None for never.
        brakings: when he brakes hard without a reason that others see.
    """

    route: Route
    start_m: float
    cruise_m_s: float
    length_m: float
    parts: tuple[tuple[Look, float], ...]
    left_m: float = 0.0
    pause_m: float = np.inf
    pause_s: float = 0.0
    passing: Passing | None = None
    brakings: tuple[Braking, ...] = ()


@dataclass(frozen=True)
class Blockade:
    """A time in which a pedestrian crossing is closed to vehicles.

    Attributes:
        road: index of the road.
        at_end: which of its ends.
        start_s, end_s: from when to when.
    """

    road: int
    at_end: bool
    start_s: float
    end_s: float
