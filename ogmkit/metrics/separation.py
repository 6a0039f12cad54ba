"""Whether connected components of the vehicle grid tell neighbouring vehicles apart.

The paper says that footprints, unlike whole bodies, do (section on occupancy grid maps). Counted are pairs
of true vehicles of one frame that a grid without any error would separate:

- at least half of each one's cells lie in the grid and in the camera's field of view, its seen cells;
- their ground faces are at most 10 m apart;
- no connected component of the true vehicle grid touches both.

A vehicle is found if a quarter of its seen cells are predicted. A pair of two found vehicles is separated if
no connected component of the predicted vehicle grid touches seen cells of both. Cells that share a corner
are connected.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import shapely

from ogmkit.grid import GridSpec
from ogmkit.metrics.iou import VEHICLES
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array

MAX_DISTANCE_M = 10.0
SEEN_SHARE = 0.5
FOUND_SHARE = 0.25

COUNTS = ("pairs", "found", "separated")
"""Pairs, those whose two vehicles are found, and those of them that are separated."""
PAIR_METRICS = ("pairs", "pairs_found", "pairs_separated")
"""Their figures' names; the last one is the share of those found."""

_CONNECTIVITY = 8


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The pairs of one frame.

    Attributes:
        seen: of each of K vehicles the seen cells, flat indices into the grid.
        pairs: (P, 2) places in `seen`.
    """

    seen: tuple[IntArray, ...]
    pairs: IntArray


def neighbours(
    faces_level: FloatArray, grid: GridSpec, truth: UInt8Array, field_of_view: UInt8Array
) -> Neighbours:
    """Find the pairs of a frame.

    Args:
        faces_level: (M, 4, 2) corners of the vehicles' ground faces in metres, level frame.
        grid: the grid.
        truth: (rows, columns) code of the rasters.
        field_of_view: (rows, columns) uint8 0/1.
    """
    faces = grid.cells(faces_level)
    lower, upper = faces.min(axis=1), faces.max(axis=1)
    in_grid = ((upper > 0) & (lower < (grid.columns - 1, grid.rows - 1))).all(axis=1)
    seen = {face: _seen_cells(faces[face], grid, field_of_view) for face in np.flatnonzero(in_grid).tolist()}
    kept = [face for face, cells in seen.items() if len(cells)]
    cells = tuple(seen[face] for face in kept)
    polygons = shapely.polygons(faces_level[kept])
    first, second = np.triu_indices(len(kept), k=1)
    near = shapely.distance(polygons[first], polygons[second]) <= MAX_DISTANCE_M
    pairs = np.column_stack([first, second])[near]
    apart = _apart(pairs, _touching(truth, cells, pairs))
    return Neighbours(cells, pairs[apart])


def count_separated(frame: Neighbours, predicted: UInt8Array) -> IntArray:
    """Count a frame's pairs in a prediction.

    Args:
        frame: its pairs.
        predicted: (rows, columns) code.

    Returns:
        (3,) int64, in the order of `COUNTS`.
    """
    if not len(frame.pairs):
        return np.zeros(len(COUNTS), np.int64)
    set_cells = (predicted & VEHICLES).ravel()
    found = np.array([np.count_nonzero(set_cells[cells]) >= FOUND_SHARE * len(cells) for cells in frame.seen])
    pairs = frame.pairs[found[frame.pairs].all(axis=1)]
    separated = _apart(pairs, _touching(predicted, frame.seen, pairs))
    return np.array([len(frame.pairs), len(pairs), np.count_nonzero(separated)])


def _seen_cells(face: FloatArray, grid: GridSpec, field_of_view: UInt8Array) -> IntArray:
    """Flat indices of the cells of a face in the grid and in view; none if they are less than half of it."""
    first = np.floor(face.min(axis=0))
    columns, rows = (np.ceil(face.max(axis=0)) - first + 1).astype(np.int64).tolist()
    # Drawn on a canvas of its own, so that what lies beyond the grid counts, too.
    row, column = np.nonzero(fill_polygons([face - first], (rows, columns)))
    column, row = column + int(first[0]), row + int(first[1])
    inside = (row >= 0) & (row < grid.rows) & (column >= 0) & (column < grid.columns)
    flat: IntArray = row[inside] * grid.columns + column[inside]
    flat = flat[field_of_view.ravel()[flat] > 0]
    return flat if len(flat) >= SEEN_SHARE * len(row) else flat[:0]


def _touching(code: UInt8Array, seen: tuple[IntArray, ...], pairs: IntArray) -> dict[int, set[int]]:
    """Vehicle of any pair → labels of the code's vehicle components that touch its seen cells."""
    _, labels = cv2.connectedComponents(code & np.uint8(VEHICLES), connectivity=_CONNECTIVITY)
    flat = labels.ravel()
    return {
        vehicle: set(np.unique(flat[seen[vehicle]]).tolist()) - {0} for vehicle in np.unique(pairs).tolist()
    }


def _apart(pairs: IntArray, touching: dict[int, set[int]]) -> BoolArray:
    """(P,) whether no component touches both vehicles."""
    apart = [touching[one].isdisjoint(touching[other]) for one, other in pairs.tolist()]
    return np.array(apart, np.bool_)
