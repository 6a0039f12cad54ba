"""Boxes in a definition's array as cross-view transformers learn them: how well seen, how near the centre."""

import re

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Definition
from ogmkit.labels.make import NO_VISIBILITY, passing, visibility_of
from ogmkit.labels.plane import Plane
from ogmkit.typing import Float32Array, FloatArray, UInt8Array


def array_from_plane(definition: Definition) -> FloatArray:
    """(3, 3) from the plane's (first, second, 1), metres, to (column, row, 1) of the points of indices."""
    matrix = np.zeros((3, 3))
    matrix[2, 2] = 1.0
    for place, axis in enumerate((definition.grid.columns, definition.grid.rows)):
        matrix[place, "xy".index(axis.coordinate)] = 1 / axis.step_m
        matrix[place, 2] = -(axis.first_m / axis.step_m + definition.cell.index_at)
    return matrix


def centres_of(boxes: Boxes, definition: Definition, plane: Plane) -> tuple[UInt8Array, Float32Array]:
    """Paint boxes in the table's order, later ones over earlier: visibility, and nearness to the centre.

    The boxes are those that the definition's `visibility` draws; where it has none, those of its classes.

    Args:
        boxes: of a key frame.
        definition: one that lies round the vehicle.
        plane: its plane.

    Returns:
        (rows, columns) uint8, the visibility level, 255 where there is no box; (rows, columns) float32
        exp(−d²), d being the distance in cells from the index's point to the box's centre, 0 without a box.
    """
    shown = _shown(boxes, definition)
    matrix = array_from_plane(definition)
    middles = plane.local(ground_corners(shown.global_from_box, shown.size_wlh).mean(axis=1))
    centres = middles @ matrix[:2, :2].T + matrix[:2, 2]
    visibility = np.full(definition.grid.shape, NO_VISIBILITY, np.uint8)
    nearness = np.zeros(definition.grid.shape, np.float32)
    corners = box_corners_canvas(definition, plane, shown)
    levels = visibility_of(shown, definition).tolist()
    for quad, level, centre in zip(corners, levels, centres, strict=True):
        rows, columns = np.nonzero(paint_boxes(definition, quad[None], [1]))
        visibility[rows, columns] = level
        distance = np.column_stack([columns, rows]) - centre
        nearness[rows, columns] = np.exp(-(distance**2).sum(axis=1))
    return visibility, nearness


def _shown(boxes: Boxes, definition: Definition) -> Boxes:
    wanted = definition.beside_categories
    if wanted:
        return boxes.selected(np.array([bool(re.search(wanted, one)) for one in boxes.category], np.bool_))
    named = np.array([definition.class_of(one) is not None for one in boxes.category], dtype=np.bool_)
    return boxes.selected(named & passing(boxes, definition))
