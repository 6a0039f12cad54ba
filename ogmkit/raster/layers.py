"""Layers of the map expansion as cells: what a frame's window meets, found by a tree (design.md §3)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.expansion import (
    LINES,
    Area,
    Expansion,
    Layer,
    expansion_path,
    file_state,
    read_expansion,
)
from ogmkit.raster.ranges import ranges
from ogmkit.raster.winding import fill_wound
from ogmkit.typing import FloatArray, IntArray, UInt8Array

_MAPS = 4
"""That a process keeps; nuScenes has four."""
_QUARTER = 32
"""Corners of a quarter circle where a line ends or turns: the edge is off by 0.03 % of half the width."""
_CORNERS = 3
"""That a ring has at least."""


@dataclass(frozen=True, eq=False)
class LayerShapes:
    """The polygons of one layer of a map; P valid polygons of R rings of V vertices, one after the other.

    Attributes:
        vertices: (V, 2) float64 x, y in metres, global frame.
        first_vertex: (R + 1,) where each ring begins.
        first_ring: (P + 1,) where each polygon begins.
        turns: (R,) +1 for rings that have the inside on their left, else −1.
        tree: of the polygons' bounds.
    """

    vertices: FloatArray
    first_vertex: IntArray
    first_ring: IntArray
    turns: IntArray
    tree: shapely.STRtree

    def rings(self, polygons: IntArray) -> tuple[FloatArray, IntArray, IntArray]:
        """Vertices, lengths and turns of the rings of some polygons."""
        rings, _ = _ranges(self.first_ring, polygons)
        vertices, lengths = _ranges(self.first_vertex, rings)
        return self.vertices[vertices], lengths, self.turns[rings]


LayerMap = Mapping[Layer, LayerShapes]
"""Layers of one location."""


def open_layers(dataroot: Path, location: str, layers: Sequence[Layer], line_width_m: float) -> LayerMap:
    """Read some layers of a location's map expansion, once for many scenes; of the file nothing else stays.

    Args:
        dataroot: the dataset's root.
        location: the map's name.
        layers: their names.
        line_width_m: of lines.

    Raises:
        DataFileError: the file is absent or damaged.
    """
    path = expansion_path(dataroot, location)
    return _layers(path, file_state(path), tuple(layers), line_width_m)


@lru_cache(maxsize=_MAPS)
def _layers(path: Path, state: int, layers: tuple[Layer, ...], line_width_m: float) -> LayerMap:
    del state  # part of the key: a file that changed is read again
    expansion = read_expansion(path)
    return {layer: layer_shapes(expansion, layer, line_width_m) for layer in layers}


def layer_shapes(expansion: Expansion, layer: Layer, line_width_m: float) -> LayerShapes:
    """The polygons that a layer covers.

    A line covers what is no farther from it than half the width, ends and corners included. An area is what
    its outer ring encloses without its holes, also where rings cross: shapely makes those valid first.

    Args:
        expansion: the location's map.
        layer: the layer's name.
        line_width_m: of lines.

    Raises:
        DataFileError: the layer is absent or damaged.
    """
    if layer in LINES:
        lines = [shapely.LineString(line) for line in expansion.lines(layer)]
        return _compiled(shapely.buffer(lines, line_width_m / 2, quad_segs=_QUARTER))
    return _compiled([piece for area in expansion.areas(layer) for piece in _pieces(area)])


def layer_masks(grid: GridSpec, level_from_global: FloatArray, layers: LayerMap) -> dict[Layer, UInt8Array]:
    """Mark the cells whose centre a layer covers; polygons that overlap unite.

    Args:
        grid: the grid.
        level_from_global: (4, 4).
        layers: of the location.

    Returns:
        Layer → (rows, columns) uint8, 1 on the layer.
    """
    if not layers:
        return {}
    window = _window(grid, level_from_global)
    found = [shapes.rings(shapes.tree.query(window, predicate="intersects")) for shapes in layers.values()]
    vertices, lengths, turns = (np.concatenate(parts) for parts in zip(*found, strict=True))
    planes = np.repeat(np.arange(len(found)), [len(lengths) for _, lengths, _ in found])
    bev_from_global = grid.bev_from_level @ level_from_global[np.ix_([0, 1, 3], [0, 1, 3])]
    cells = vertices @ bev_from_global[:2, :2].T + bev_from_global[:2, 2]
    masks = fill_wound(cells, lengths, turns, planes, (len(found), *grid.shape))
    return dict(zip(layers, masks, strict=True))


def _window(grid: GridSpec, level_from_global: FloatArray) -> shapely.Polygon:
    """The grid's outline in the global frame."""
    (near, far), (right, left) = grid.x_range_m, grid.y_range_m
    corners = np.array([[near, right, 0], [far, right, 0], [far, left, 0], [near, left, 0]])
    return shapely.Polygon(transform_points(inverse(level_from_global), corners)[:, :2])


def _ranges(first: IntArray, wanted: IntArray) -> tuple[IntArray, IntArray]:
    """All members of some groups, given where each group begins; and how many each has."""
    counts = first[wanted + 1] - first[wanted]
    return ranges(first[wanted], counts), counts


def _pieces(area: Area) -> Sequence[shapely.Polygon]:
    """The area as valid polygons; even-odd is inside an outer ring that crosses itself."""
    holes = [hole for hole in area.holes if len(hole) >= _CORNERS]
    if len(area.outer) < _CORNERS:
        return []
    whole = shapely.Polygon(area.outer, holes)
    if shapely.is_valid(whole):
        return [whole]
    outer, *inner = (shapely.make_valid(shapely.Polygon(ring)) for ring in (area.outer, *holes))
    parts = shapely.get_parts(shapely.get_parts(shapely.difference(outer, shapely.union_all(inner))))
    return [part for part in parts if isinstance(part, shapely.Polygon)]


def _compiled(polygons: Sequence[shapely.Polygon] | NDArray[np.object_]) -> LayerShapes:
    rings, polygon_of_ring = shapely.get_rings(polygons, return_index=True)
    vertices, ring_of_vertex = shapely.get_coordinates(rings, return_index=True)
    first_ring = np.searchsorted(polygon_of_ring, np.arange(len(polygons) + 1))
    is_outer = np.isin(np.arange(len(rings)), first_ring)
    return LayerShapes(
        vertices,
        np.searchsorted(ring_of_vertex, np.arange(len(rings) + 1)),
        first_ring,
        np.where(shapely.is_ccw(rings) == is_outer, 1, -1),
        shapely.STRtree(shapely.box(*shapely.bounds(polygons).reshape(-1, 4).T)),
    )
