"""Draws a town's street network: a ring road with a crossroads inside, lanes and turns."""

import numpy as np

from ogmkit.synthetic.curves import Path, direction, even_path, hermite, turn
from ogmkit.synthetic.streets import CORNER_M, PARKING_M, SHOULDER_M, CrossSection, Lane, Network, Road
from ogmkit.typing import FloatArray

_MARGIN_M = 48.0
_TAPER_M = 5.0
_BAY_CLEARANCE_M = 20.0  # between a junction and the first parked car
_STRAIGHT_RAD = np.radians(40)

_RING, _NORTH_SOUTH, _WEST_EAST = range(3)
HUB = 4
"""Index of the junction in the middle, where two streets cross."""
# Street, from junction, to junction. Junctions on the ring: 0 east, 1 north, 2 west, 3 south.
_ROADS = (
    *((_RING, corner, (corner + 1) % 4) for corner in range(4)),
    (_NORTH_SOUTH, 1, HUB),
    (_NORTH_SOUTH, HUB, 3),
    (_WEST_EAST, 2, HUB),
    (_WEST_EAST, HUB, 0),
)


def build_network(random: np.random.Generator, size_m: tuple[float, float], *, keeps_left: bool) -> Network:
    """Draw a town's streets.

    Args:
        random: source of the shapes.
        size_m: width and height of the map.
        keeps_left: which side of the road traffic uses.
    """
    sections = _draw_sections(random)
    junctions, centres = _draw_centres(random, np.array(size_m))
    roads = tuple(
        _draw_road(random, centre, sections[street], (origin, end), _trims(sections, street, (origin, end)))
        for (street, origin, end), centre in zip(_ROADS, centres, strict=True)
    )
    side = 1 if keeps_left else -1
    lanes = tuple(lane for index, road in enumerate(roads) for lane in _lanes_of(road, index, side))
    turns, following = _draw_turns(lanes, side)
    return Network(junctions, roads, lanes + turns, following, side)


def _draw_sections(random: np.random.Generator) -> tuple[CrossSection, CrossSection, CrossSection]:
    lanes = [2, *random.permutation([1, 2])]
    lane_m = random.uniform(3.2, 3.7, 3)
    walkway_m = random.uniform(2.5, 4.5, 3)
    medians = [float(random.uniform(2.5, 4.5)), 0.0, 0.0]
    ring, north_south, west_east = (
        CrossSection(int(lanes[k]), float(lane_m[k]), medians[k], float(walkway_m[k])) for k in range(3)
    )
    return ring, north_south, west_east


def _draw_centres(random: np.random.Generator, size_m: FloatArray) -> tuple[FloatArray, list[Path]]:
    """Centres of the junctions and the middle lines of all roads, from centre to centre."""
    middle = size_m / 2
    ring_angles = np.arange(4) * np.pi / 2 + random.uniform(-0.22, 0.22, 4)
    ring_shape = _RingShape(random, middle - _MARGIN_M)
    hub = middle + random.uniform(-22, 22, 2)
    junctions = np.vstack([middle + ring_shape.at(ring_angles), hub])
    centres = []
    for start, angle in enumerate(ring_angles):
        end = ring_angles[(start + 1) % 4] + (2 * np.pi if start == 3 else 0.0)
        centres.append(even_path(middle + ring_shape.at(np.linspace(angle, end, 600))))
    inward = [ring_shape.inward(angle) for angle in ring_angles]
    axis = float(np.arctan2(*(junctions[3] - junctions[1])[::-1])) + random.uniform(-0.25, 0.25)
    skew = random.uniform(-0.2, 0.2)
    for street, origin, end in _ROADS[4:]:
        heading = axis if street == _NORTH_SOUTH else axis + np.pi / 2 + skew
        reach_m = float(np.linalg.norm(junctions[end] - junctions[origin]))
        start_tangent = direction(heading) if origin == HUB else inward[origin]
        end_tangent = direction(heading) if end == HUB else -inward[end]
        centres.append(
            hermite(junctions[origin], junctions[end], reach_m * start_tangent, reach_m * end_tangent)
        )
    return junctions, centres


class _RingShape:
    """A closed smooth curve round the origin: a superellipse with gentle waves."""

    def __init__(self, random: np.random.Generator, half_axes_m: FloatArray) -> None:
        self._half_axes_m = half_axes_m
        self._exponent = random.uniform(2.6, 4.2)
        self._phases = random.uniform(0, 2 * np.pi, 2)

    def at(self, angle: FloatArray) -> FloatArray:
        """(..., 2) points at (...) polar angles."""
        ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        powers = (np.abs(ray) / self._half_axes_m) ** self._exponent
        waves = 1 + 0.035 * np.cos(3 * angle + self._phases[0]) + 0.025 * np.cos(5 * angle + self._phases[1])
        radius_m = powers.sum(-1) ** (-1 / self._exponent) * waves
        result: FloatArray = radius_m[..., None] * ray
        return result

    def inward(self, angle: float) -> FloatArray:
        """(2,) unit normal that points into the ring."""
        before, after = self.at(np.array([angle - 1e-3, angle + 1e-3]))
        tangent = (after - before) / np.linalg.norm(after - before)
        return np.array([-tangent[1], tangent[0]])


def _trims(
    sections: tuple[CrossSection, CrossSection, CrossSection], street: int, ends: tuple[int, int]
) -> list[float]:
    """How much of a road, at either end, belongs to the junction."""
    at_hub = {_NORTH_SOUTH: _WEST_EAST, _WEST_EAST: _NORTH_SOUTH}
    joining = {0: _WEST_EAST, 1: _NORTH_SOUTH, 2: _WEST_EAST, 3: _NORTH_SOUTH}
    across = [
        joining[junction] if street == _RING else at_hub[street] if junction == HUB else _RING
        for junction in ends
    ]
    return [sections[other].half_m + CORNER_M + 3.0 for other in across]


def _draw_road(
    random: np.random.Generator,
    centre: Path,
    section: CrossSection,
    ends: tuple[int, int],
    trims_m: list[float],
) -> Road:
    centre = centre.part(trims_m[0], centre.length - trims_m[1])
    kerbs, bays = [], []
    for _ in range(2):
        stretches = _draw_bays(random, centre.length)
        parking = np.zeros(len(centre.points))
        for start, end in stretches:
            parking += _smooth_step(centre.distances - start) * _smooth_step(end - centre.distances)
        wave = 0.25 * (1 + np.sin(centre.distances / random.uniform(9, 16) + random.uniform(0, 6)))
        fade = _smooth_step(centre.distances - 2 * _TAPER_M)
        fade = fade * _smooth_step(centre.length - 2 * _TAPER_M - centre.distances)
        kerbs.append(section.half_m + SHOULDER_M + PARKING_M * parking + wave * fade)
        bays.append(stretches)
    return Road(centre, section, ends, kerbs[0], kerbs[1], (bays[0], bays[1]))


def _draw_bays(random: np.random.Generator, length_m: float) -> tuple[tuple[float, float], ...]:
    """Stretches with a parking strip: none, one or two."""
    first, last = _BAY_CLEARANCE_M, length_m - _BAY_CLEARANCE_M
    if last - first < 15 or random.uniform() < 0.15:
        return ()
    if last - first < 50:
        return ((first, last),)
    gap_start = random.uniform(first + 14, last - 28)
    return ((first, gap_start), (gap_start + 14, last))


def _smooth_step(distance_m: FloatArray) -> FloatArray:
    """0 below −taper, 1 above 0, smooth between."""
    t = np.clip(distance_m / _TAPER_M + 1, 0, 1)
    step: FloatArray = t * t * (3 - 2 * t)
    return step


def _lanes_of(road: Road, index: int, traffic_side: int) -> list[Lane]:
    section = road.section
    lanes = []
    for forward in (True, False):
        side = traffic_side if forward else -traffic_side
        origin, junction = road.ends if forward else road.ends[::-1]
        for rank in range(section.lanes):
            left_m = side * (section.median_m / 2 + (rank + 0.5) * section.lane_m)
            path = road.centre.offset(left_m)
            path = path if forward else path.reversed()
            lanes.append(Lane(path, section.lane_m, index, origin, junction, rank, side))
    return lanes


def _draw_turns(
    lanes: tuple[Lane, ...], traffic_side: int
) -> tuple[tuple[Lane, ...], tuple[tuple[int, ...], ...]]:
    """Ways through the junctions, and which lanes follow each lane."""
    turns: list[Lane] = []
    following: list[tuple[int, ...]] = [() for _ in lanes]
    of_turns: list[tuple[int, ...]] = []
    for index, lane in enumerate(lanes):
        for other_index, other in enumerate(lanes):
            if other.origin != lane.junction or other.road == lane.road:
                continue
            if not _connects(lane, other, lanes, traffic_side):
                continue
            path = turn(
                lane.path.points[-1],
                float(lane.path.headings[-1]),
                other.path.points[0],
                float(other.path.headings[0]),
            )
            following[index] += (len(lanes) + len(turns),)
            of_turns.append((other_index,))
            turns.append(Lane(path, min(lane.width_m, other.width_m), -1, lane.junction, lane.junction, 0, 0))
    return tuple(turns), (*following, *of_turns)


def _connects(lane: Lane, other: Lane, lanes: tuple[Lane, ...], traffic_side: int) -> bool:
    """Straight on keeps the rank; turns to the kerb are for outer lanes, turns across for inner ones."""
    change = float(other.path.headings[0] - lane.path.headings[-1])
    change = (change + np.pi) % (2 * np.pi) - np.pi
    outermost = _outermost(lane, lanes)
    if abs(change) < _STRAIGHT_RAD:
        return min(lane.rank, _outermost(other, lanes)) == other.rank and lane.rank <= other.rank
    if change * traffic_side > 0:
        return lane.rank == outermost and other.rank == _outermost(other, lanes)
    return lane.rank == 0 and other.rank == 0


def _outermost(lane: Lane, lanes: tuple[Lane, ...]) -> int:
    return max(other.rank for other in lanes if (other.road, other.side) == (lane.road, lane.side))
