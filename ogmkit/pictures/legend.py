"""What the colours of a contact sheet mean."""

from collections.abc import Iterable, Iterator

import numpy as np

from ogmkit.pictures.bev_panel import (
    DOT_RADIUS,
    EGO_COLOUR,
    EGO_SHAPE,
    FUTURE_COLOUR,
    PAST_COLOUR,
    shade,
)
from ogmkit.pictures.camera_panel import BOX_COLOURS, OTHER_COLOUR
from ogmkit.pictures.canvas import MUTED, Canvas
from ogmkit.typing import UInt8Array

TEXT_SIZE = 22

_SIDE, _ENTRY_GAP, _GROUP_GAP = 20, 28, 64
_LINE, _BASELINE = 38, 24
_WIDEST = 4000
_CELLS = {
    "drivable": (1, 0, 1),
    "vehicle": (0, 1, 1),
    "not drivable": (0, 0, 1),
    "drivable, not in view": (1, 0, 0),
    "vehicle, not in view": (0, 1, 0),
}
"""Label → share of drivable, of vehicle, of field of view."""
_PATHS = {"past, every 0.5 s": PAST_COLOUR, "future": FUTURE_COLOUR}
_BOXES = {
    "vehicle": BOX_COLOURS["vehicle"],
    "person": BOX_COLOURS["human"],
    "movable object": BOX_COLOURS["movable_object"],
    "other": OTHER_COLOUR,
}

Entry = tuple[UInt8Array, str]
"""A square swatch and its label."""


def draw_legend(width: int) -> UInt8Array:
    """Draw the legend: groups in a row as far as they fit, then the next line.

    Args:
        width: of the whole legend in pixels; a single group may need more and gets it.
    """
    lines: list[list[UInt8Array]] = []
    room = 0
    for group in (
        _draw_group("Plane", _cell_entries()),
        _draw_group("Ego", _ego_entries()),
        _draw_group("Boxes, front filled", _box_entries()),
    ):
        if group.shape[1] > room:
            lines.append([])
            room = width
        lines[-1].append(group)
        room -= group.shape[1] + _GROUP_GAP
    return _stack(lines, width)


def _stack(lines: list[list[UInt8Array]], width: int) -> UInt8Array:
    """Put groups into their lines; all have the same height."""
    widths = [sum(group.shape[1] + _GROUP_GAP for group in line) - _GROUP_GAP for line in lines]
    canvas = Canvas(_LINE * len(lines), max(width, *widths))
    for number, line in enumerate(lines):
        left = 0
        for group in line:
            canvas.paste(group, left, number * _LINE)
            left += group.shape[1] + _GROUP_GAP
    return canvas.pixels


def _draw_group(heading: str, entries: Iterable[Entry]) -> UInt8Array:
    """Draw a heading and its entries in one line; returns (_LINE, w, 3)."""
    canvas = Canvas(_LINE, _WIDEST)
    x = canvas.text(heading, 0, _BASELINE, TEXT_SIZE) + _ENTRY_GAP
    for swatch, label in entries:
        canvas.paste(swatch, x, _BASELINE - _SIDE + 3)
        x += _SIDE + 10
        x += canvas.text(label, x, _BASELINE, TEXT_SIZE, MUTED) + _ENTRY_GAP
    return canvas.pixels[:, : x - _ENTRY_GAP]


def _cell_entries() -> Iterator[Entry]:
    for label, shares in _CELLS.items():
        yield shade(*(np.full((_SIDE, _SIDE), float(share)) for share in shares)), label


def _ego_entries() -> Iterator[Entry]:
    middle = (_SIDE - 1) / 2
    for label, colour in _PATHS.items():
        swatch = Canvas(_SIDE, _SIDE)
        swatch.polyline(np.array([[0, middle], [_SIDE - 1, middle]]), colour)
        swatch.dots(np.array([[middle, middle]]), colour, DOT_RADIUS)
        yield swatch.pixels, label
    swatch = Canvas(_SIDE, _SIDE)
    swatch.polygon(EGO_SHAPE * 0.8 + middle, EGO_COLOUR)
    yield swatch.pixels, "now"


def _box_entries() -> Iterator[Entry]:
    for label, colour in _BOXES.items():
        yield Canvas(_SIDE, _SIDE, colour).pixels, label
