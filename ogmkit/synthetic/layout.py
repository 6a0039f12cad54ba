"""The areas and lines of a synthetic town: drivable surface with its holes, walkways, markings."""

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiLineString, MultiPolygon
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from ogmkit.synthetic.carparks import CarPark, place_car_parks
from ogmkit.synthetic.ground import GroundLayers
from ogmkit.synthetic.junctions import between, junction_area, junction_arms, road_area
from ogmkit.synthetic.network import build_network
from ogmkit.synthetic.streets import CROSSING_M, PARKING_M, STOP_M, Network, Road

_CROSSING_START_M = 0.7
_STOP_LINE_M = 0.5
_ISLAND_CLEARANCE_M = 7.0
_SMALLEST_AREA_M2 = 0.5  # unions leave slivers


@dataclass(frozen=True)
class Location:
    """A place that has a map.

    Attributes:
        name: one of nuScenes' four; its devkit knows no others.
        size_m: width and height of the map.
        keeps_left: which side of the road traffic uses there.
    """

    name: str
    size_m: tuple[float, float]
    keeps_left: bool

    @property
    def index(self) -> int:
        """Its place among `LOCATIONS`."""
        return LOCATIONS.index(self)


LOCATIONS = (
    Location("boston-seaport", (400.0, 380.0), keeps_left=False),
    Location("singapore-onenorth", (380.0, 420.0), keeps_left=True),
    Location("singapore-queenstown", (420.0, 390.0), keeps_left=True),
    Location("singapore-hollandvillage", (390.0, 400.0), keeps_left=True),
)


@dataclass(frozen=True, eq=False)
class Layout:
    """Everything on one map, in `global` metres, coordinates rounded to millimetres.

    Attributes:
        location: which map.
        network: its streets.
        car_parks: its car parks.
        road_areas: each road's surface, in the order of `network.roads`.
        junction_areas: each junction's surface, in the order of `network.junctions`.
        crossings: (road, at the road's end) → pedestrian crossing.
        stop_lines: (road, at the road's end) → strip before which incoming traffic waits.
        layers: what cameras see on the ground.
    """

    location: Location
    network: Network
    car_parks: tuple[CarPark, ...]
    road_areas: tuple[Polygon, ...]
    junction_areas: tuple[Polygon, ...]
    crossings: dict[tuple[int, bool], Polygon]
    stop_lines: dict[tuple[int, bool], Polygon]
    layers: GroundLayers


def build_layout(seed: int, location: Location) -> Layout:
    """Draw one map; the same seed and location give the same map."""
    random = np.random.default_rng([seed, 1, location.index])
    network = build_network(random, location.size_m, keeps_left=location.keeps_left)
    car_parks = place_car_parks(random, network)
    arms = [junction_arms(network, junction) for junction in range(len(network.junctions))]
    junctions = [junction_area(around) for around in arms]
    roads = [road_area(road) for road in network.roads]
    crossings = {key: _across(network, key, _CROSSING_START_M, CROSSING_M) for key in _road_ends(network)}
    stop_lines = {key: _stop_line(network, key) for key in _road_ends(network)}
    corners = [corner for _, around in junctions for corner in around]
    layers = _ground_layers(
        network, car_parks, roads, [area for area, _ in junctions], corners, list(crossings.values())
    )
    return Layout(
        location,
        network,
        car_parks,
        tuple(_rounded(area) for area in roads),
        tuple(_rounded(area) for area, _ in junctions),
        {key: _rounded(area) for key, area in crossings.items()},
        {key: _rounded(area) for key, area in stop_lines.items()},
        layers,
    )


def _ground_layers(
    network: Network,
    car_parks: tuple[CarPark, ...],
    roads: list[Polygon],
    junctions: list[Polygon],
    corners: list[Polygon],
    crossings: list[Polygon],
) -> GroundLayers:
    paved = shapely.union_all(
        [*roads, *junctions, *(park.area for park in car_parks), *(park.driveway for park in car_parks)]
    )
    islands = [_median(road) for road in network.roads if road.section.median_m > 0]
    islands += [park.island for park in car_parks]
    drivable = _areas(shapely.difference(paved, shapely.union_all(islands)))
    strips = [strip for road in network.roads for strip in _walkway_strips(road)]
    # Behind a tight kerb a wide walkway's outer edge crosses itself.
    walkways = shapely.union_all(shapely.make_valid([*strips, *corners]))
    walkway = shapely.difference(walkways, paved)
    bays = [line for road in network.roads for line in _bay_lines(road)]
    stalls = [line for park in car_parks for line in park.stall_lines]
    dividers = [line for road in network.roads for line in lane_divider_lines(road)]
    dividers += [line for road in network.roads for line in road_divider_lines(road)]
    return GroundLayers(
        drivable=drivable,
        walkway=_areas(walkway),
        crossings=MultiPolygon([_rounded(area) for area in crossings]),
        islands=_areas(shapely.union_all(islands)),
        lane_dividers=MultiLineString(dividers),
        road_edges=_lines(drivable.boundary),
        parking_lines=MultiLineString([*bays, *(LineString(line) for line in stalls)]),
    )


def lane_divider_lines(road: Road) -> list[LineString]:
    """Lines between lanes of one direction."""
    section = road.section
    lefts = [
        side * (section.median_m / 2 + rank * section.lane_m)
        for side in (-1, 1)
        for rank in range(1, section.lanes)
    ]
    return [_marking(road, left) for left in lefts]


def road_divider_lines(road: Road) -> list[LineString]:
    """The line between the directions, or the two edges of the island between them."""
    half_m = road.section.median_m / 2
    return [_marking(road, left) for left in ((-half_m, half_m) if half_m else (0.0,))]


def _marking(road: Road, left_m: float) -> LineString:
    centre = road.centre.part(STOP_M, road.centre.length - STOP_M)
    line: LineString = _rounded(LineString(centre.offset(left_m).simplified().points))
    return line


def _road_ends(network: Network) -> list[tuple[int, bool]]:
    return [(index, at_end) for index in range(len(network.roads)) for at_end in (False, True)]


def _stretch(network: Network, key: tuple[int, bool], start_m: float, width_m: float) -> tuple[float, float]:
    """Distances along the road of a strip that begins `start_m` from one of its ends."""
    length_m = network.roads[key[0]].centre.length
    return (length_m - start_m - width_m, length_m - start_m) if key[1] else (start_m, start_m + width_m)


def _across(network: Network, key: tuple[int, bool], start_m: float, width_m: float) -> Polygon:
    """A strip from kerb to kerb."""
    road = network.roads[key[0]]
    piece = road.centre.part(*_stretch(network, key, start_m, width_m))
    half_m = road.section.half_m
    return between(piece.offset(half_m).simplified(), piece.offset(-half_m).simplified())


def _stop_line(network: Network, key: tuple[int, bool]) -> Polygon:
    """A strip across the lanes that lead into the junction."""
    road = network.roads[key[0]]
    piece = road.centre.part(*_stretch(network, key, STOP_M - _STOP_LINE_M, _STOP_LINE_M))
    side = network.traffic_side if key[1] else -network.traffic_side
    inner, outer = side * road.section.median_m / 2, side * road.section.half_m
    return between(piece.offset(inner).simplified(), piece.offset(outer).simplified())


def _median(road: Road) -> Polygon:
    """The island between the directions, with rounded noses."""
    piece = road.centre.part(_ISLAND_CLEARANCE_M, road.centre.length - _ISLAND_CLEARANCE_M)
    half_m = road.section.median_m / 2
    from_nose_m = np.minimum(piece.distances, piece.length - piece.distances)
    reach = np.clip(1 - from_nose_m / half_m, 0, 1)
    width_m = (half_m - 0.3) * np.sqrt(1 - 0.98 * reach**2)
    return between(piece.offset(width_m).simplified(), piece.offset(-width_m).simplified())


def _walkway_strips(road: Road) -> list[Polygon]:
    width_m = road.section.walkway_m
    return [
        between(road.centre.offset(kerb_m).simplified(), road.centre.offset(kerb_m + out_m).simplified())
        for kerb_m, out_m in ((road.left_m, width_m), (-road.right_m, -width_m))
    ]


def _bay_lines(road: Road) -> list[LineString]:
    """The inner borders of parking strips."""
    lines = []
    for side, kerb_m, bays in ((1, road.left_m, road.bays[0]), (-1, road.right_m, road.bays[1])):
        border = road.centre.offset(side * (kerb_m - PARKING_M))
        lines += [LineString(border.part(*bay).simplified().points) for bay in bays]
    return lines


def _areas(geometry: BaseGeometry) -> MultiPolygon:
    """The polygons of a union or difference, slivers dropped."""
    parts = shapely.get_parts(_rounded(geometry))
    return MultiPolygon([part for part in parts if part.area > _SMALLEST_AREA_M2])


def _lines(geometry: BaseGeometry) -> MultiLineString:
    return MultiLineString(list(shapely.get_parts(geometry)))


def _rounded(geometry: BaseGeometry) -> BaseGeometry:
    """The same, valid, with millimetre coordinates, so that text files hold exactly what is drawn."""
    return shapely.transform(shapely.set_precision(geometry, 1e-3), lambda points: np.round(points, 3))
