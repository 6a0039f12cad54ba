"""Map records cut with the part of the map that an array covers, by the field's two ways."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
import shapely
from shapely import affinity

from ogmkit.errors import DataFileError
from ogmkit.labels.cut_lines import cut_line
from ogmkit.labels.definition import Axis, Definition
from ogmkit.labels.plane import Plane
from ogmkit.nuscenes.expansion import Expansion
from ogmkit.typing import FloatArray

Rings = tuple[FloatArray, ...]
Piece = tuple[FloatArray, Rings]
"""Outer ring and holes, (K, 2) metres on the plane, closed."""


@lru_cache(maxsize=64)
def _records(expansion: Expansion, layer: str, lines: bool) -> tuple[shapely.STRtree, FloatArray]:
    """The layer's records and whether each is valid; the tree keeps them."""
    found: list[shapely.Geometry]
    if lines:
        found = [shapely.LineString(line) for line in expansion.lines(layer)]
    else:
        found = [shapely.Polygon(area.outer, area.holes) for area in expansion.areas(layer)]
    return shapely.STRtree(found), shapely.is_valid(found)


def turned_pieces(
    definition: Definition, plane: Plane, expansion: Expansion, layer: str
) -> Iterator[tuple[Piece, ...]]:
    """The polygons of each record inside the square, as nuscenes-devkit cuts them: turned, then cut again.

    Invalid records are left out, but of drivable areas.

    Raises:
        DataFileError: an invalid one can't be cut.
    """
    tree, valid = _records(expansion, layer, lines=False)
    rows = _near(tree, _square(definition, plane))
    for row in rows:
        if valid[row] or layer == "drivable_area":
            yield _pieces(_turned(definition, plane, tree.geometries[row], expansion))


def turned_lines(
    definition: Definition, plane: Plane, expansion: Expansion, layer: str
) -> Iterator[FloatArray]:
    """The lines inside the square, (K, 2) metres on the plane, cut likewise."""
    square, upright = (_corners(one) for one in (_square(definition, plane), _box(definition)))
    tree = _records(expansion, layer, lines=True)[0]
    for row in _near(tree, _square(definition, plane)):
        for part in cut_line(shapely.get_coordinates(tree.geometries[row]), square):
            back = _turned_back(plane, shapely.LineString(part))
            yield from cut_line(shapely.get_coordinates(back), upright)


def extent_pieces(
    definition: Definition, plane: Plane, expansion: Expansion, layer: str
) -> Iterator[tuple[Piece, ...]]:
    """The polygons of each valid record inside the array's extent, in the order of an R-tree's query."""
    tree, valid = _records(expansion, layer, lines=False)
    extent = shapely.Polygon(_from_local(plane, shapely.get_coordinates(_box(definition))))
    for row in tree.query(extent):
        if valid[row]:
            cut = shapely.intersection(tree.geometries[row], extent)
            yield _pieces(shapely.transform(cut, plane.local_2d))


def _near(tree: shapely.STRtree, region: shapely.Polygon) -> list[int]:
    """Records whose bounds meet the region's, in the file's order."""
    rows: list[int] = sorted(tree.query(region).tolist())
    return rows


def _box(definition: Definition) -> shapely.Polygon:
    """The extent of an array on its plane."""
    bounds = {axis.coordinate: _reach(axis) for axis in (definition.grid.rows, definition.grid.columns)}
    (x0, x1), (y0, y1) = bounds["x"], bounds.get("y") or bounds["z"]
    return shapely.box(x0, y0, x1, y1)


def _reach(axis: Axis) -> tuple[float, float]:
    ends = (axis.first_m - axis.step_m / 2, axis.first_m + (axis.cells - 0.5) * axis.step_m)
    return min(ends), max(ends)


def _square(definition: Definition, plane: Plane) -> shapely.Polygon:
    """The extent on the map; turned in degrees about its middle, to the last bit as the devkit does."""
    x, y = plane.origin_global[:2]
    upright = affinity.translate(_box(definition), x, y)
    return affinity.rotate(upright, plane.turn_rad / np.pi * 180, origin=(x, y), use_radians=False)


def _corners(polygon: shapely.Polygon) -> FloatArray:
    """(4, 2) corners, counter-clockwise."""
    corners: FloatArray = shapely.get_coordinates(polygon)[:-1]
    return corners


def _turned(
    definition: Definition, plane: Plane, record: shapely.Geometry, expansion: Expansion
) -> shapely.Geometry:
    try:
        cut = shapely.intersection(record, _square(definition, plane))
    except shapely.errors.GEOSException as error:
        raise DataFileError(
            f"{expansion.path}: an invalid polygon can't be cut ({error}); mend it"
        ) from error
    return shapely.intersection(_turned_back(plane, cut), _box(definition))


def _turned_back(plane: Plane, geometry: shapely.Geometry) -> shapely.Geometry:
    x, y = plane.origin_global[:2]
    back = affinity.rotate(geometry, -plane.turn_rad / np.pi * 180, origin=(x, y), use_radians=False)
    return affinity.affine_transform(back, [1.0, 0.0, 0.0, 1.0, -x, -y])


def _pieces(geometry: shapely.Geometry) -> tuple[Piece, ...]:
    return tuple(
        (
            shapely.get_coordinates(part.exterior),
            tuple(shapely.get_coordinates(hole) for hole in part.interiors),
        )
        for part in shapely.get_parts(geometry)
        if part.geom_type == "Polygon" and not part.is_empty
    )


def _from_local(plane: Plane, points_local: FloatArray) -> FloatArray:
    matrix = np.linalg.inv(plane.local_from_global[:, :2])
    result: FloatArray = points_local @ matrix.T + plane.origin_global[:2]
    return result
