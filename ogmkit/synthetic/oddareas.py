"""Walkways as real maps have some: concave, and invalid because their rings cross or touch themselves."""

from itertools import cycle

from shapely import Polygon

from ogmkit.synthetic.roadside import beside
from ogmkit.synthetic.streets import Network, Road

_RINGS_M = (
    ((0, 0), (12, 0), (12, 8), (9, 8), (9, 3), (3, 3), (3, 8), (0, 8)),  # concave
    ((0, 0), (10, 6), (10, 0), (0, 6)),  # a bow tie
    ((0, 0), (8, 0), (8, 4), (14, 4), (8, 4), (8, 7), (0, 7)),  # out and back along one line
    ((0, 0), (5, 0), (5, 4), (9, 8), (9, 0), (12, 0), (12, 4), (5, 4), (0, 4)),  # through one node twice
)
"""Corners, metres along a road and away from it."""
_OVERLAP_M = 1.0  # with the usual walkway


def odd_walkways(network: Network) -> list[Polygon]:
    """One beside the middle of each road, on both sides, of every shape in turn."""
    rings = cycle(_RINGS_M)
    return [_placed(road, side, next(rings)) for road in network.roads for side in (1, -1)]


def _placed(road: Road, side: int, ring_m: tuple[tuple[int, int], ...]) -> Polygon:
    middle_m, edge_m = road.centre.length / 2, road.section.walkway_m - _OVERLAP_M
    return Polygon([beside(road, side, middle_m + along, edge_m + out)[:2] for along, out in ring_m])
