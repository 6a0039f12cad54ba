"""What the colours of a sheet mean."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ogmkit.drawing.bev_panel import DOT_RADIUS, EGO_SHAPE
from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.cells import agreement_colours, target_colours
from ogmkit.drawing.further_cells import LAYERS, class_colours, draw_way, instance_colours, layer_colours
from ogmkit.drawing.palette import Colour, theme
from ogmkit.typing import UInt8Array

TEXT_SIZE = 22

_SIDE, _ENTRY_GAP, _GROUP_GAP = 20, 28, 64
_LINE, _BASELINE = 38, 24
_WIDEST = 4000
_MIDDLE = (_SIDE - 1) / 2
_CELLS = {
    "drivable": (1, 0, 1),
    "vehicle": (0, 1, 1),
    "not drivable": (0, 0, 1),
    "drivable, not in view": (1, 0, 0),
    "vehicle, not in view": (0, 1, 0),
}
"""Label → drivable, vehicle, in the field of view."""
_AGREEMENT = {"both": (1, 1), "only true": (1, 0), "only the other": (0, 1)}
_PATHS = {"past": "first", "future": "future"}
_BOXES = {"vehicle": "vehicle", "person": "second", "movable object": "first", "other": "muted"}
"""Label → the theme's colour."""

Entry = tuple[UInt8Array, str]
"""A square swatch and its label."""
Group = tuple[str, Callable[[], Iterable[Entry]]]
"""A heading and what makes its entries."""


def draw_legend(groups: Sequence[Group], width: int) -> UInt8Array:
    """Draw a legend: groups in a row as far as they fit, then the next line.

    Args:
        groups: at least one. A group that is wider than the legend is wrapped, aligned with its first entry.
        width: of the whole legend in pixels; a single entry may need more and gets it.
    """
    lines: list[list[UInt8Array]] = []
    room = 0
    for heading, entries in groups:
        drawn = _draw_group(heading, entries(), width)
        if drawn.shape[1] > room:
            lines.append([])
            room = width
        lines[-1].append(drawn)
        room -= drawn.shape[1] + _GROUP_GAP
    return _stack(lines, width)


def _stack(lines: list[list[UInt8Array]], width: int) -> UInt8Array:
    """Put groups into their lines."""
    widths = [sum(group.shape[1] + _GROUP_GAP for group in line) - _GROUP_GAP for line in lines]
    heights = [max(group.shape[0] for group in line) for line in lines]
    canvas = Canvas(sum(heights), max([width, *widths]))
    top = 0
    for line, height in zip(lines, heights, strict=True):
        left = 0
        for group in line:
            canvas.paste(group, left, top)
            left += group.shape[1] + _GROUP_GAP
        top += height
    return canvas.pixels


def _draw_group(heading: str, entries: Iterable[Entry], width: int) -> UInt8Array:
    """Draw a heading and its entries in as few lines as the width allows; returns (lines · _LINE, w, 3)."""
    title = Canvas(_LINE, _WIDEST)
    start = title.text(heading, 0, _BASELINE, TEXT_SIZE) + _ENTRY_GAP
    placed: list[tuple[UInt8Array, int, int]] = []
    x, line = start, 0
    for drawn in map(_draw_entry, entries):
        if x > start and x + drawn.shape[1] > width:
            x, line = start, line + 1
        placed.append((drawn, x, line))
        x += drawn.shape[1] + _ENTRY_GAP
    canvas = Canvas(
        _LINE * (line + 1), max([start - _ENTRY_GAP, *(at + one.shape[1] for one, at, _ in placed)])
    )
    canvas.paste(title.pixels[:, : start - _ENTRY_GAP], 0, 0)
    for drawn, left, number in placed:
        canvas.paste(drawn, left, number * _LINE)
    return canvas.pixels


def _draw_entry(entry: Entry) -> UInt8Array:
    """Draw a swatch and its label; returns (_LINE, w, 3)."""
    swatch, label = entry
    canvas = Canvas(_LINE, _WIDEST)
    canvas.paste(swatch, 0, _BASELINE - _SIDE + 3)
    end = _SIDE + 10 + canvas.text(label, _SIDE + 10, _BASELINE, TEXT_SIZE, theme().muted)
    return canvas.pixels[:, :end]


def _cell_entries() -> Iterator[Entry]:
    for label, cells in _CELLS.items():
        yield _bordered(target_colours(*map(_uniform, cells))), label
    yield from _edge_entries()


def _edge_entries() -> Iterator[Entry]:
    half = _uniform(0)
    half[: _SIDE // 2] = 1
    yield _bordered(target_colours(_uniform(0), _uniform(0), half)), "edge of the view"


def _vehicle_entries() -> Iterator[Entry]:
    nothing, seen = _uniform(0), _uniform(1)
    for label, (true, other) in _AGREEMENT.items():
        yield agreement_colours((nothing, _uniform(true)), (nothing, _uniform(other)), seen), label


def _drivable_entries() -> Iterator[Entry]:
    nothing, seen = _uniform(0), _uniform(1)
    for label, (true, other) in _AGREEMENT.items():
        yield agreement_colours((_uniform(true), nothing), (_uniform(other), nothing), seen), label


def _ego_entries() -> Iterator[Entry]:
    for label, colour in _PATHS.items():
        yield _dotted(getattr(theme(), colour)), label
    swatch = Canvas(_SIDE, _SIDE)
    swatch.polygon(EGO_SHAPE * 0.8 + _MIDDLE, theme().text)
    yield swatch.pixels, "now"


def _dotted(colour: Colour) -> UInt8Array:
    """A swatch of a path: a line and a point."""
    swatch = Canvas(_SIDE, _SIDE)
    swatch.polyline(np.array([[0, _MIDDLE], [_SIDE - 1, _MIDDLE]]), colour)
    swatch.rings(np.full((1, 2), _MIDDLE), colour, DOT_RADIUS, Canvas(_SIDE, _SIDE).pixels)
    return swatch.pixels


def _box_entries() -> Iterator[Entry]:
    for label, colour in _BOXES.items():
        yield Canvas(_SIDE, _SIDE, getattr(theme(), colour)).pixels, label


def _instance_entries() -> Iterator[Entry]:
    nothing, inside = _uniform(0), _uniform(0)
    inside[3:-3, 3:-3] = 1
    quarters = np.repeat(np.arange(1, 5, dtype=np.uint8), _SIDE // 4)[None] + nothing
    yield instance_colours(quarters, nothing, nothing, _uniform(1)), "vehicles, each in one colour"
    yield instance_colours(nothing, inside, nothing, _uniform(1)), "later"
    swatch = Canvas(_SIDE, _SIDE)
    draw_way(swatch, np.array([[2, _MIDDLE], [_SIDE - 5, _MIDDLE]]))
    yield swatch.pixels, "way to the next key frame"


def _image_entries() -> Iterator[Entry]:
    for label in ("drivable", "vehicle"):
        yield Canvas(_SIDE, _SIDE, getattr(theme(), label)).pixels, label


def _ground_entries() -> Iterator[Entry]:
    nothing, seen = (_uniform(0),) * 2, _uniform(1)
    yield agreement_colours((seen, _uniform(0)), (seen, _uniform(0)), seen), "drivable"
    yield _bordered(agreement_colours(nothing, nothing, seen)), "not drivable"
    yield from _edge_entries()


def _bordered(pixels: UInt8Array) -> UInt8Array:
    """A swatch with a border, since the ground is hardly another colour than the page."""
    swatch = Canvas(_SIDE, _SIDE)
    swatch.paste(pixels, 0, 0)
    swatch.frame(_SIDE, _SIDE, theme().muted)
    return swatch.pixels


def _uniform(value: int) -> UInt8Array:
    return np.full((_SIDE, _SIDE), value, dtype=np.uint8)


def layer_group(layers: Iterable[str]) -> Group:
    """Layers of the map, by their names in `LAYERS`."""
    shown = {layer: _uniform(1) for layer in layers}
    return "Map layers", lambda: (
        (layer_colours({layer: shown[layer]}, _uniform(0)), layer.replace("_", " "))
        for layer in LAYERS
        if layer in shown
    )


def class_group(classes: Sequence[str]) -> Group:
    """Classes, in their order."""
    masks = np.eye(len(classes), dtype=np.uint8)[:, :, None, None] * _uniform(1)
    return "Classes", lambda: (
        (class_colours(mask, _uniform(0), _uniform(1)), name)
        for name, mask in zip(classes, masks, strict=True)
    )


PLANE: Group = ("Plane", _cell_entries)
EGO: Group = ("Ego", _ego_entries)
BOXES: Group = ("Boxes, front filled", _box_entries)
IMAGE: Group = ("Masks", _image_entries)
INSTANCES: Group = ("Instances", _instance_entries)
GROUND: Group = ("Plane", _ground_entries)
VEHICLES: Group = ("Vehicles compared", _vehicle_entries)
DRIVABLE: Group = ("Drivable area compared", _drivable_entries)
