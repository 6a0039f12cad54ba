"""Colours of cells of what shards hold beside the paper's targets: map layers, classes, instances."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType

import numpy as np

from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.cells import stripes, target_colours, with_edge
from ogmkit.drawing.palette import theme
from ogmkit.typing import FloatArray, UInt8Array, UInt16Array

LAYERS: Mapping[str, str] = MappingProxyType(
    {
        "drivable_area": "drivable",
        "carpark_area": "carpark",
        "walkway": "walkway",
        "road_segment": "road",
        "lane": "lane",
        "ped_crossing": "first",
        "stop_line": "second",
        "lane_divider": "future",
        "road_divider": "vehicle",
    }
)
"""Layer → the theme's colour. Later ones lie on top: areas, then what is painted on them, a step apart."""

_MARKS = "vehicle", "first", "second", "future"
_SLOPES = 0, 1, -1


def layer_colours(layers: Mapping[str, UInt8Array], field_of_view: UInt8Array) -> UInt8Array:
    """Colours (rows, columns, 3) of the map's layers, with the edge of the view.

    Args:
        layers: names in `LAYERS` → (rows, columns) uint8, all but 0 being set.
        field_of_view: (rows, columns) uint8.
    """
    shown = np.full((*field_of_view.shape, 3), theme().ground, dtype=np.uint8)
    for name, colour in LAYERS.items():
        if name in layers:
            shown[layers[name] > 0] = getattr(theme(), colour)
    return with_edge(shown, field_of_view > 0)


def class_colours(
    classes: Iterable[UInt8Array], drivable: UInt8Array, field_of_view: UInt8Array
) -> UInt8Array:
    """Colours (rows, columns, 3) of classes over the drivable area: four solid, four of each kind of stripes.

    Args:
        classes: (rows, columns) uint8 each, all but 0 being set; later ones lie on top.
        drivable: the same.
        field_of_view: the same.
    """
    shown = target_colours(drivable, np.zeros_like(drivable), field_of_view)
    for place, mask in enumerate(classes):
        turn, mark = divmod(place, len(_MARKS))
        slope = _SLOPES[turn % len(_SLOPES)]
        shown[mask > 0] = getattr(theme(), _MARKS[mark])
        if slope:
            shown[(mask > 0) & stripes(mask.shape, slope)] = theme().ground
    return shown


def instance_colours(
    numbers: UInt8Array | UInt16Array, later: UInt8Array, drivable: UInt8Array, field_of_view: UInt8Array
) -> UInt8Array:
    """Colours (rows, columns, 3) of instances over the drivable area, each in one of four by its number.

    Args:
        numbers: (rows, columns), 0 for none.
        later: (rows, columns) uint8, all but 0 being outlined: where vehicles will be.
        drivable: (rows, columns) uint8, all but 0 being set.
        field_of_view: the same.
    """
    shown = target_colours(drivable, np.zeros_like(drivable), field_of_view)
    with_edge(shown, later > 0)
    there = numbers > 0
    table = np.array([getattr(theme(), mark) for mark in _MARKS], np.uint8)
    shown[there] = table[(numbers[there] - 1) % len(_MARKS)]
    return shown


def draw_way(canvas: Canvas, way: FloatArray) -> None:
    """Draw a (2, 2) way in pixels: a line with a point at its end, which is seen on vehicles by its rim."""
    canvas.cased_polyline(way, theme().text)
    canvas.dots(way[1:], theme().text, 2.0)
