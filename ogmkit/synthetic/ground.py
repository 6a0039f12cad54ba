"""The ground's painted surfaces, as polygons in `global` metres."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import MultiLineString, MultiPolygon, Polygon
from shapely.ops import substring

from ogmkit.typing import FloatArray

Area: TypeAlias = Polygon | MultiPolygon
HeightFunction = Callable[[FloatArray], FloatArray]
"""Ground height in metres (...) at global (..., 2) positions."""

_LINE_WIDTH_M = 0.15
_DASH_M, _DASH_PERIOD_M = 3.0, 7.5
_ZEBRA_M, _ZEBRA_PERIOD_M = 0.5, 1.0


@dataclass(frozen=True)
class GroundLayers:
    """What lies on the ground, in `global` metres; later layers are painted over earlier ones.

    Attributes:
        drivable: roads and car parks; the islands are holes in it.
        walkway: pavements beside the road.
        crossings: pedestrian crossings, painted as zebra stripes across their longer side.
        islands: raised islands inside the drivable area.
        lane_dividers: painted dashed.
        road_edges: kerbs.
        parking_lines: borders of parking bays, painted solid.
    """

    drivable: Area
    walkway: Area
    crossings: Area
    islands: Area
    lane_dividers: MultiLineString
    road_edges: MultiLineString
    parking_lines: MultiLineString


def markings(layers: GroundLayers) -> list[Polygon]:
    """Everything painted in white: dashes, parking lines and zebra stripes."""
    stripes = [stripe for crossing in polygons(layers.crossings) for stripe in _zebra(crossing)]
    lines = [*_dashes(layers.lane_dividers), *layers.parking_lines.geoms]
    return stripes + _strips(lines, _LINE_WIDTH_M)


def kerbs(layers: GroundLayers) -> list[Polygon]:
    """The kerb stones along the road's edges."""
    return _strips(list(layers.road_edges.geoms), 2 * _LINE_WIDTH_M)


def polygons(area: shapely.Geometry) -> Iterator[Polygon]:
    """The polygons of an area or collection; empty ones, points and lines are left out."""
    for part in shapely.get_parts(area):
        if isinstance(part, Polygon) and not part.is_empty:
            yield part


def _strips(lines: list[shapely.Geometry], width_m: float) -> list[Polygon]:
    buffered = shapely.buffer(
        np.asarray(lines, dtype=object), width_m / 2, cap_style="flat", join_style="mitre"
    )
    return [polygon for strip in buffered for polygon in polygons(strip)]


def _dashes(dividers: MultiLineString) -> list[shapely.Geometry]:
    return [
        substring(line, start, start + _DASH_M)
        for line in dividers.geoms
        for start in np.arange(_DASH_PERIOD_M / 4, line.length - _DASH_M, _DASH_PERIOD_M)
    ]


def _zebra(crossing: Polygon) -> Iterator[Polygon]:
    # Normalised, since GEOS releases begin the rectangle at different corners.
    rectangle = shapely.get_coordinates(shapely.normalize(shapely.minimum_rotated_rectangle(crossing)))
    origin, first, second = rectangle[0], rectangle[1] - rectangle[0], rectangle[3] - rectangle[0]
    along, across = (first, second) if np.hypot(*first) >= np.hypot(*second) else (second, first)
    length_m = float(np.hypot(*along))
    unit: FloatArray = along / length_m
    for start in np.arange((_ZEBRA_PERIOD_M - _ZEBRA_M) / 2, length_m - _ZEBRA_M / 2, _ZEBRA_PERIOD_M):
        near, far = origin + start * unit, origin + min(start + _ZEBRA_M, length_m) * unit
        yield from polygons(Polygon([near, far, far + across, near + across]).intersection(crossing))
