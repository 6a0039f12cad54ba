"""From a key frame and a definition to arrays."""

import re

import numpy as np
from numpy.typing import NDArray

from ogmkit.frames import Boxes, KeyFrame
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Definition
from ogmkit.labels.ignore import ignored
from ogmkit.labels.layers import paint_layer
from ogmkit.labels.map_mask import paint_mask
from ogmkit.labels.plane import Plane, plane_of
from ogmkit.nuscenes.expansion import Expansion
from ogmkit.nuscenes.maps import MapMask
from ogmkit.typing import BoolArray, UInt8Array

LabelArray = NDArray[np.uint8] | NDArray[np.uint16]

NO_VISIBILITY = 255
"""Of the array `visibility`: no box."""


def labels_of(
    key_frame: KeyFrame, definition: Definition, location_map: Expansion | MapMask | None = None
) -> dict[str, LabelArray]:
    """All arrays of a key frame, by name.

    Args:
        key_frame: one sample.
        definition: what to draw.
        location_map: needed where the definition has map classes: the drivable-area mask where its layers are
            `mask`, else the expansion.

    Returns:
        (rows, columns) each: classes, `valid` and `ignore` uint8 0/1; `visibility` uint8, the level of the
        box drawn last or 255 (of FIERY, 0) for none; `instance` uint16, 0 for none.

    Raises:
        ValueError: the definition needs a map, and none is given.
        TableError: it needs a camera's frame, and the sample has none.
        DataFileError: a layer is absent or damaged.
    """
    if definition.needs_map and location_map is None:
        raise ValueError(f"definition {definition.name} needs a map")
    plane = plane_of(definition.frame, key_frame)
    class_of = {name: definition.class_of(name) for name in set(key_frame.boxes.category)}
    shown = passing(key_frame.boxes, definition)
    arrays: dict[str, LabelArray] = {}
    for one in definition.classes:
        if one.layers and isinstance(location_map, Expansion):
            arrays[one.name] = paint_layer(definition, plane, location_map, one.layers)
        elif one.layers and isinstance(location_map, MapMask):
            arrays[one.name] = paint_mask(key_frame, definition, location_map)
        elif one.unites:
            arrays[one.name] = np.maximum.reduce([arrays[name] for name in one.unites])
        else:
            named = np.array([class_of[name] == one.name for name in key_frame.boxes.category], np.bool_)
            arrays[one.name] = _painted(definition, plane, key_frame.boxes.selected(named & shown))
    return arrays | _beside(key_frame, definition, plane)


def visibility_of(boxes: Boxes, definition: Definition) -> UInt8Array:
    """(M,) visibility levels, with the level that unknown ones count as."""
    unknown = definition.filters.unknown_visibility
    return np.where(boxes.visibility == 0, unknown, boxes.visibility).astype(np.uint8)


def passing(boxes: Boxes, definition: Definition) -> BoolArray:
    """(M,) whether boxes pass the definition's filters."""
    filters = definition.filters
    seen = visibility_of(boxes, definition) >= filters.min_visibility
    number = boxes.num_lidar_pts
    result: BoolArray = seen & ((number >= filters.min_lidar_points) | (number < 0))
    return result


def _painted(definition: Definition, plane: Plane, boxes: Boxes) -> UInt8Array:
    corners = box_corners_canvas(definition, plane, boxes)
    return paint_boxes(definition, corners, [1] * len(corners)).astype(np.uint8)


def _beside(key_frame: KeyFrame, definition: Definition, plane: Plane) -> dict[str, LabelArray]:
    """Arrays that are no class; boxes are drawn in the table's order, later ones over earlier."""
    boxes = key_frame.boxes
    found: dict[str, LabelArray] = {}
    wanted = definition.beside_categories
    drawn = np.array([bool(wanted and re.search(wanted, one)) for one in boxes.category], dtype=np.bool_)
    if "instance" in definition.beside:
        shown = boxes.selected(drawn & passing(boxes, definition))
        corners = box_corners_canvas(definition, plane, shown)
        numbers = range(1, len(shown) + 1)
        found["instance"] = paint_boxes(definition, corners, numbers).astype(np.uint16)
    if "visibility" in definition.beside:
        shown = boxes.selected(drawn)
        corners = box_corners_canvas(definition, plane, shown)
        background = 0 if "instance" in definition.beside else NO_VISIBILITY
        levels = visibility_of(shown, definition).tolist()
        found["visibility"] = paint_boxes(definition, corners, levels, background).astype(np.uint8)
    if "valid" in definition.beside:
        found["valid"] = (found["visibility"] >= 2).astype(np.uint8)
    if "ignore" in definition.beside:
        found["ignore"] = ignored(key_frame, definition, plane)
    return found
