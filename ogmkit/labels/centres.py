"""Boxes in a definition's array as cross-view transformers learn them: how well seen, where the centre is."""

import re

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Definition
from ogmkit.labels.make import NO_VISIBILITY, passing, visibility_of
from ogmkit.labels.plane import Plane
from ogmkit.typing import Float32Array, FloatArray, IntArray, UInt8Array

CHANNELS = 8
"""Of `centre_channels`."""


def array_from_plane(definition: Definition) -> FloatArray:
    """(3, 3) from the plane's (first, second, 1), metres, to (column, row, 1) of the points of indices."""
    matrix = np.zeros((3, 3))
    matrix[2, 2] = 1.0
    for place, axis in enumerate((definition.grid.columns, definition.grid.rows)):
        matrix[place, "xy".index(axis.coordinate)] = 1 / axis.step_m
        matrix[place, 2] = -(axis.first_m / axis.step_m + definition.cell.index_at)
    return matrix


def centres_of(boxes: Boxes, definition: Definition, plane: Plane) -> tuple[UInt8Array, Float32Array]:
    """How well seen the box of each cell is, and how near its centre: of the box drawn last.

    Args:
        boxes: of a key frame; those that the definition's `visibility` draws count, or where it has none,
            those of its classes.
        definition: one that lies round the vehicle.
        plane: its plane.

    Returns:
        (rows, columns) uint8, the visibility level, 255 where there is no box; (rows, columns) float32
        exp(−d²), d being the distance in cells from the index's point to the box's centre, 0 without a box.
    """
    shown, owner = _painted(boxes, definition, plane)
    visibility = np.full(owner.shape, NO_VISIBILITY, np.uint8)
    nearness = np.zeros(owner.shape, np.float32)
    under = owner > 0
    visibility[under] = visibility_of(shown, definition)[owner[under] - 1]
    nearness[under] = _nearness(_offsets(_corners(shown, definition, plane), owner))[:, 0]
    return visibility, nearness


def centre_channels(boxes: Boxes, definition: Definition, plane: Plane) -> Float32Array:
    """What cross_view_transformers keeps of each cell's box beside the classes.

    Args:
        boxes: as of `centres_of`.
        definition: the same.
        plane: the same.

    Returns:
        (rows, columns, 8): 255 under a box; exp(−d²) of the distance d to its centre; that centre's offset
        along columns and rows; the front's direction along them; half the box's length and width; all in
        cells, 0 elsewhere.
    """
    shown, owner = _painted(boxes, definition, plane)
    every = _corners(shown, definition, plane)
    found = np.zeros((*owner.shape, CHANNELS), np.float32)
    corners, offset = every[owner[owner > 0] - 1], _offsets(every, owner)
    centre = corners.mean(axis=1)
    ahead, aside = (corners[:, pair].mean(axis=1) - centre for pair in ([0, 1], [0, 3]))
    length, width = (np.linalg.norm(half, axis=1, keepdims=True) for half in (ahead, aside))
    nearness = _nearness(offset)
    found[owner > 0] = np.concatenate(
        [np.full_like(nearness, 255), nearness, offset, ahead / (length + 1e-6), length, width], axis=1
    )
    return found


def _painted(boxes: Boxes, definition: Definition, plane: Plane) -> tuple[Boxes, IntArray]:
    """The boxes that are drawn, and (rows, columns) which of them, from 1, a cell shows: the last one."""
    wanted = definition.beside_categories
    if wanted:
        drawn = np.array([bool(re.search(wanted, one)) for one in boxes.category], dtype=np.bool_)
    else:
        named = np.array([definition.class_of(one) is not None for one in boxes.category], dtype=np.bool_)
        drawn = named & passing(boxes, definition)
    shown = boxes.selected(drawn)
    corners = box_corners_canvas(definition, plane, shown)
    return shown, paint_boxes(definition, corners, range(1, len(corners) + 1)).astype(np.int64)


def _corners(boxes: Boxes, definition: Definition, plane: Plane) -> FloatArray:
    """(M, 4, 2) column and row of lower corners in the array, front right first and round the box."""
    matrix = array_from_plane(definition)
    local = plane.local(ground_corners(boxes.global_from_box, boxes.size_wlh))
    corners: FloatArray = local @ matrix[:2, :2].T + matrix[:2, 2]
    return corners


def _offsets(corners: FloatArray, owner: IntArray) -> FloatArray:
    """(K, 2) columns and rows from cells under a box, in the array's order, to the box's centre."""
    rows, columns = np.nonzero(owner)
    offsets: FloatArray = corners.mean(axis=1)[owner[rows, columns] - 1] - np.stack([columns, rows], axis=-1)
    return offsets


def _nearness(offsets: FloatArray) -> FloatArray:
    """(K, 1) exp(−d²) of (K, 2)."""
    near: FloatArray = np.exp(-(offsets**2).sum(axis=1, keepdims=True))
    return near
