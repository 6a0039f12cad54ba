"""The area of a junction: its arms' mouths joined by rounded kerbs, and the walkways round them."""

from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon

from ogmkit.synthetic.curves import Path, direction, turn
from ogmkit.synthetic.streets import Network, Road
from ogmkit.typing import FloatArray


@dataclass(frozen=True, eq=False)
class Arm:
    """The mouth of a road at a junction, seen from the junction's middle.

    Attributes:
        outward_rad: direction away from the junction.
        mouth: (K, 2) from the right kerb across the edges of all lanes to the left kerb.
        walkway_m: width of the road's walkways.
    """

    outward_rad: float
    mouth: FloatArray
    walkway_m: float


def junction_arms(network: Network, junction: int) -> list[Arm]:
    """The roads that end at a junction, counterclockwise."""
    arms = [
        _arm(road, at_end=bool(end)) for road in network.roads for end in (0, 1) if road.ends[end] == junction
    ]
    return sorted(arms, key=lambda arm: arm.outward_rad)


def junction_area(arms: list[Arm]) -> tuple[Polygon, list[Polygon]]:
    """The junction's drivable area and the walkways at its corners; arms counterclockwise."""
    ring: list[FloatArray] = []
    corners = []
    for arm, following in zip(arms, arms[1:] + arms[:1], strict=True):
        kerb = turn(arm.mouth[-1], arm.outward_rad + np.pi, following.mouth[0], following.outward_rad)
        ring += [arm.mouth, kerb.simplified().points[1:-1]]
        share = kerb.distances / kerb.length
        width_m = (1 - share) * arm.walkway_m + share * following.walkway_m
        corners.append(between(kerb.simplified(), kerb.offset(-width_m).simplified()))
    return Polygon(np.concatenate(ring)), corners


def between(one: Path, other: Path) -> Polygon:
    """The area between two paths that run side by side."""
    return Polygon(np.concatenate([one.points, other.points[::-1]]))


def road_area(road: Road) -> Polygon:
    """The surface of a road; its corners at the mouths are the junctions' too."""
    left = road.centre.offset(road.left_m).simplified().points
    right = road.centre.offset(-road.right_m).simplified().points
    start, end = _mouth(road, at_end=False), _mouth(road, at_end=True)
    return Polygon(np.concatenate([start[:-1], left, end[1:-1][::-1], right[::-1]]))


def _arm(road: Road, *, at_end: bool) -> Arm:
    heading = float(road.centre.headings[-1 if at_end else 0]) + (np.pi if at_end else 0.0)
    mouth = _mouth(road, at_end=at_end)
    outward = float(np.arctan2(np.sin(heading), np.cos(heading)))
    return Arm(outward, mouth[::-1] if at_end else mouth, road.section.walkway_m)


def _mouth(road: Road, *, at_end: bool) -> FloatArray:
    """(K, 2) points across one end of a road, from its right kerb to its left one."""
    index = -1 if at_end else 0
    edges = road.section.lane_edges_m
    offsets = np.array([-road.right_m[index], *(-edges[::-1]), *edges, road.left_m[index]])
    normal = direction(float(road.centre.headings[index]) + np.pi / 2)
    points: FloatArray = road.centre.points[index] + np.unique(offsets)[:, None] * normal
    return points
