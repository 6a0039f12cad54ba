"""Map layers in a definition's array, each by its repository's rule.

- `whole`: every record whose bounds come within 150 m, not clipped: outer ring 1, then its holes 0; lines are
  one cell wide.
- `cut`: each record cut with the square, as nuscenes-devkit's masks: all outer rings 1, then all holes 0;
  lines of thickness 2 through coordinates cut toward zero.
- `cut-convex`: each valid record cut with the array's extent; its rings are filled as if they were convex.

In all of them a hole erases what an earlier record drew. The fill `centre` has a rule of its own: even-odd in
a record, a union over records.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ogmkit.labels.boxes import as_stored, canvas_points, canvas_shape
from ogmkit.labels.cut import extent_pieces, turned_lines, turned_pieces
from ogmkit.labels.definition import Definition
from ogmkit.labels.fill import paint_convex, paint_outlined, rounded
from ogmkit.labels.outline import line_cells
from ogmkit.labels.plane import Plane
from ogmkit.labels.stroke import stroke_two
from ogmkit.nuscenes.expansion import LINES, Area, Expansion
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import FloatArray, UInt8Array

_NEAR_M = 150.0

Strokes = tuple[Sequence[FloatArray], int]
"""Rings that are filled in one call, (K, 2) (column, row) in the picture, and with what."""


def paint_layer(
    definition: Definition, plane: Plane, expansion: Expansion, layers: Sequence[str]
) -> UInt8Array:
    """(rows, columns) uint8: the union of some layers of a map."""
    canvas = np.zeros(canvas_shape(definition), dtype=np.uint8)
    for layer in layers:
        drawn = np.zeros_like(canvas)
        if layer in LINES:
            _paint_lines(drawn, definition, plane, expansion, layer)
        else:
            _paint_areas(drawn, definition, plane, expansion, layer)
        canvas |= drawn
    return as_stored(definition, canvas)


def _paint_areas(
    canvas: UInt8Array, definition: Definition, plane: Plane, expansion: Expansion, layer: str
) -> None:
    if definition.cell.fill == "centre":
        _paint_centres(canvas, definition, plane, expansion.areas(layer))
    elif definition.cell.layers == "cut-convex":
        for pieces in extent_pieces(definition, plane, expansion, layer):
            for outer, holes in pieces:
                rings = [rounded(canvas_points(definition, plane, ring)) for ring in (outer, *holes)]
                paint_convex(canvas, rings, [1] + [0] * len(holes))
    else:
        whole = definition.cell.layers == "whole"
        fills = (_whole if whole else _cut)(definition, plane, expansion, layer)
        calls = [(rings, value) for rings, value in fills if len(rings)]
        rings = [rounded(canvas_points(definition, plane, ring)) for one, _ in calls for ring in one]
        owners = [number for number, (one, _) in enumerate(calls) for _ in one]
        paint_outlined(canvas, rings, owners, [value for _, value in calls])


def _whole(definition: Definition, plane: Plane, expansion: Expansion, layer: str) -> Iterator[Strokes]:
    del definition
    centre = plane.centre_global
    for area in expansion.areas(layer):
        if _is_near(area.outer - centre):
            yield [plane.local_2d(area.outer)], 1
            yield [plane.local_2d(hole) for hole in area.holes], 0


def _cut(definition: Definition, plane: Plane, expansion: Expansion, layer: str) -> Iterator[Strokes]:
    for pieces in turned_pieces(definition, plane, expansion, layer):
        yield [outer for outer, _ in pieces], 1
        yield [hole for _, holes in pieces for hole in holes], 0


def _paint_centres(canvas: UInt8Array, definition: Definition, plane: Plane, areas: Sequence[Area]) -> None:
    rings = [
        (number, canvas_points(definition, plane, plane.local_2d(ring)))
        for number, area in enumerate(areas)
        for ring in (area.outer, *area.holes)
    ]
    owners = [number for number, _ in rings]
    canvas |= fill_polygons([ring for _, ring in rings], canvas.shape, polygon_of_ring=owners)


def _paint_lines(
    canvas: UInt8Array, definition: Definition, plane: Plane, expansion: Expansion, layer: str
) -> None:
    if definition.cell.layers == "cut":
        for line in turned_lines(definition, plane, expansion, layer):
            stroke_two(canvas, np.trunc(canvas_points(definition, plane, line)).astype(np.int64))
        return
    centre = plane.centre_global
    for line in expansion.lines(layer):
        if _is_near(line - centre):
            local = plane.local_2d(line.astype(np.float32).astype(np.float64))
            points = rounded(canvas_points(definition, plane, local))
            canvas.reshape(-1)[line_cells(points[:-1], points[1:], canvas.shape)[1]] = 1


def _is_near(from_centre_m: FloatArray) -> bool:
    """Whether bounds meet a square round the plane's origin; what lies farther reaches no cell."""
    low, high = from_centre_m.min(axis=0), from_centre_m.max(axis=0)
    return bool((low <= _NEAR_M).all() and (high >= -_NEAR_M).all())
