"""Boxes in a definition's array: the four lower corners, rounded to its lattice and painted by its rule."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.labels.definition import Axis, Definition
from ogmkit.labels.fill import paint_convex, paint_outlined, rounded
from ogmkit.labels.plane import Plane
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import FloatArray

_Value = TypeVar("_Value", bound=np.generic)


def canvas_shape(definition: Definition) -> tuple[int, int]:
    """(rows, columns) of the picture that is drawn in."""
    rows, columns = definition.grid.shape
    return (rows, columns) if definition.cell.drawn == "as-stored" else (columns, rows)


def canvas_points(definition: Definition, plane: Plane, local_m: FloatArray) -> FloatArray:
    """(..., 2) metres on the plane to (..., 2) (column, row) of that picture, not yet rounded."""
    grid, at = definition.grid, definition.cell.index_at
    row, column = (
        _index(local_m[..., plane.names.index(axis.coordinate)], axis, at)
        for axis in (grid.rows, grid.columns)
    )
    if definition.cell.drawn == "as-stored":
        return np.stack([column, row], axis=-1)
    if definition.cell.drawn == "transposed-turned":
        row, column = grid.rows.cells - 1 - row, grid.columns.cells - 1 - column
    return np.stack([row, column], axis=-1)


def as_stored(definition: Definition, canvas: NDArray[_Value]) -> NDArray[_Value]:
    """The array of a picture that was drawn."""
    if definition.cell.drawn == "as-stored":
        return canvas
    turned = canvas[::-1, ::-1] if definition.cell.drawn == "transposed-turned" else canvas
    return np.ascontiguousarray(turned.T)


def box_corners_canvas(definition: Definition, plane: Plane, boxes: Boxes) -> FloatArray:
    """(M, 4, 2) (column, row) of each box's lower corners in the picture, not yet rounded."""
    corners = ground_corners(boxes.global_from_box, boxes.size_wlh)
    return canvas_points(definition, plane, plane.local(corners))


def paint_boxes(
    definition: Definition, corners: FloatArray, values: Sequence[int], background: int = 0
) -> NDArray[np.int32]:
    """The array with boxes painted one over the other.

    Args:
        definition: whose rule.
        corners: (M, 4, 2) in the picture.
        values: of each box.
        background: of all other cells.

    Returns:
        (rows, columns) int32.
    """
    canvas = np.full(canvas_shape(definition), background, dtype=np.int32)
    fill = definition.cell.fill
    if fill == "outline":
        paint_outlined(canvas, list(rounded(corners)), range(len(corners)), list(values))
    elif fill == "convex-outline":
        paint_convex(canvas, list(rounded(corners)), list(values))
    else:
        for quad, value in zip(corners, values, strict=True):
            canvas[fill_polygons([quad], canvas.shape) > 0] = value
    return as_stored(definition, canvas)


def _index(coordinate_m: FloatArray, axis: Axis, index_at: float) -> FloatArray:
    result: FloatArray = (coordinate_m - (axis.first_m + index_at * axis.step_m)) / axis.step_m
    return result
