"""What the colours of a sheet mean."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ogmkit.pictures.bev_panel import DOT_RADIUS, EGO_COLOUR, EGO_SHAPE, FUTURE_COLOUR, PAST_COLOUR
from ogmkit.pictures.camera_panel import BOX_COLOURS, DRIVABLE_TINT, OTHER_COLOUR, VEHICLE_TINT
from ogmkit.pictures.canvas import MUTED, Canvas, Colour
from ogmkit.pictures.cells import VEHICLE_COLOUR, agreement_colours, target_colours
from ogmkit.pictures.further_panel import FUTURE_COLOUR as LATER_COLOUR
from ogmkit.pictures.further_panel import LAYER_COLOURS
from ogmkit.typing import UInt8Array

TEXT_SIZE = 22

_SIDE, _ENTRY_GAP, _GROUP_GAP = 20, 28, 64
_LINE, _BASELINE = 38, 24
_WIDEST = 4000
_ROAD: Colour = (110, 110, 110)
_CELLS = {
    "drivable": (1, 0, 1),
    "vehicle": (0, 1, 1),
    "not drivable": (0, 0, 1),
    "drivable, not in view": (1, 0, 0),
    "vehicle, not in view": (0, 1, 0),
}
"""Label → drivable, vehicle, in the field of view."""
_AGREEMENT = {"both": (1, 1), "only true": (1, 0), "only re-warped": (0, 1)}
_PATHS = {"past, every 0.5 s": PAST_COLOUR, "future": FUTURE_COLOUR}
_BOXES = {
    "vehicle": BOX_COLOURS["vehicle"],
    "person": BOX_COLOURS["human"],
    "movable object": BOX_COLOURS["movable_object"],
    "other": OTHER_COLOUR,
}

Entry = tuple[UInt8Array, str]
"""A square swatch and its label."""
Group = tuple[str, Callable[[], Iterable[Entry]]]
"""A heading and what makes its entries."""


def draw_legend(groups: Sequence[Group], width: int) -> UInt8Array:
    """Draw a legend: groups in a row as far as they fit, then the next line.

    Args:
        groups: at least one.
        width: of the whole legend in pixels; a single group may need more and gets it.
    """
    lines: list[list[UInt8Array]] = []
    room = 0
    for heading, entries in groups:
        drawn = _draw_group(heading, entries())
        if drawn.shape[1] > room:
            lines.append([])
            room = width
        lines[-1].append(drawn)
        room -= drawn.shape[1] + _GROUP_GAP
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
    for label, cells in _CELLS.items():
        yield target_colours(*map(_uniform, cells)), label


def _vehicle_entries() -> Iterator[Entry]:
    nothing, seen = _uniform(0), _uniform(1)
    for label, (true, other) in _AGREEMENT.items():
        yield agreement_colours((nothing, _uniform(true)), (nothing, _uniform(other)), seen), label


def _drivable_entries() -> Iterator[Entry]:
    nothing, seen = _uniform(0), _uniform(1)
    for label, (true, other) in _AGREEMENT.items():
        yield agreement_colours((_uniform(true), nothing), (_uniform(other), nothing), seen), label


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


def _layer_entries() -> Iterator[Entry]:
    others = {"vehicle, or its class or instance": VEHICLE_COLOUR, "later": LATER_COLOUR}
    for label, colour in {**LAYER_COLOURS, **others}.items():
        yield Canvas(_SIDE, _SIDE, colour).pixels, label.replace("_", " ")


def _image_entries() -> Iterator[Entry]:
    for label, tint in {"drivable": DRIVABLE_TINT, "vehicle": VEHICLE_TINT}.items():
        yield _tinted(*tint), label


def _ground_entries() -> Iterator[Entry]:
    nothing, seen = (_uniform(0),) * 2, _uniform(1)
    yield agreement_colours((seen, _uniform(0)), (seen, _uniform(0)), seen), "drivable"
    yield agreement_colours(nothing, nothing, seen), "not drivable"
    yield agreement_colours(nothing, nothing, _uniform(0)), "not in view"


def _tinted(colour: Colour, opacity: float) -> UInt8Array:
    swatch = Canvas(_SIDE, _SIDE, _ROAD)
    swatch.tint(np.ones(swatch.shape), colour, opacity)
    return swatch.pixels


def _uniform(value: int) -> UInt8Array:
    return np.full((_SIDE, _SIDE), value, dtype=np.uint8)


PLANE: Group = ("Plane", _cell_entries)
EGO: Group = ("Ego", _ego_entries)
BOXES: Group = ("Boxes, front filled", _box_entries)
IMAGE: Group = ("Image", _image_entries)
LAYERS: Group = ("Plane", _layer_entries)
GROUND: Group = ("Plane", _ground_entries)
VEHICLES: Group = ("Vehicles compared", _vehicle_entries)
DRIVABLE: Group = ("Drivable area compared", _drivable_entries)
