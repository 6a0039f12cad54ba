"""Ways through the street network, and how fast they can be driven."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ogmkit.synthetic.curves import Path, joined
from ogmkit.synthetic.streets import Network
from ogmkit.typing import FloatArray

_LATERAL_M_S2 = 2.0
_BRAKING_M_S2 = 1.4


@dataclass(frozen=True, eq=False)
class Route:
    """Lanes and turns that follow each other.

    Attributes:
        lanes: indices into the network's lanes.
        starts_m: (K + 1,) where each lane begins on the path; the last is the path's end.
        path: their middle lines, joined.
    """

    lanes: tuple[int, ...]
    starts_m: FloatArray
    path: Path

    @classmethod
    def along(cls, network: Network, lanes: tuple[int, ...]) -> "Route":
        """The route over given lanes."""
        paths = [network.lanes[lane].path for lane in lanes]
        starts_m = np.concatenate([[0.0], np.cumsum([path.length for path in paths])])
        return cls(lanes, starts_m, joined(paths))

    def index_at(self, distance_m: float) -> int:
        """Which of the route's lanes a distance falls on."""
        last = len(self.lanes) - 1
        return int(np.clip(np.searchsorted(self.starts_m, distance_m, side="right") - 1, 0, last))

    @cached_property
    def _bend_speeds_squared(self) -> FloatArray:
        curvature = np.abs(self.path.curvatures)
        smooth = np.convolve(np.pad(curvature, 4, mode="edge"), np.full(9, 1 / 9), mode="valid")
        return _LATERAL_M_S2 / np.maximum(smooth, 1e-6)

    def speed_limits(self, cruise_m_s: FloatArray | float) -> FloatArray:
        """(N,) speed at each path point that bends allow, braking for them in time.

        Args:
            cruise_m_s: speed on a straight, everywhere the same or (N,) at each point.
        """
        energy = np.minimum(self._bend_speeds_squared, cruise_m_s**2)
        slope = 2 * _BRAKING_M_S2 * self.path.distances
        ahead = np.minimum.accumulate((energy + slope)[::-1])[::-1] - slope
        limits: FloatArray = np.sqrt(np.maximum(ahead, 1.0))
        return limits


def draw_route(
    random: np.random.Generator, network: Network, first: tuple[int, ...], length_m: float
) -> Route:
    """Continue given lanes at random until the route is long enough."""
    lanes = list(first)
    total_m = sum(network.lanes[lane].path.length for lane in lanes)
    while total_m < length_m:
        lanes.append(int(random.choice(network.following[lanes[-1]])))
        total_m += network.lanes[lanes[-1]].path.length
    return Route.along(network, tuple(lanes))
