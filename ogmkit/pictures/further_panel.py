"""The plane with what a shard holds beside the paper's targets: layers, classes, instances, what follows."""

from collections.abc import Iterator, Mapping

import numpy as np

from ogmkit.pictures.bev_panel import Plan, draw_plane
from ogmkit.pictures.canvas import GREEN, ORANGE, PURPLE, SKY_BLUE, TEXT, YELLOW, Canvas, Colour
from ogmkit.pictures.cells import DRIVABLE_COLOUR, GROUND_COLOUR, VEHICLE_COLOUR
from ogmkit.pictures.views import View
from ogmkit.typing import FloatArray, UInt8Array

LAYER_COLOURS: Mapping[str, Colour] = {
    "drivable_area": DRIVABLE_COLOUR,
    "carpark_area": (88, 76, 112),
    "walkway": (116, 98, 78),
    "road_segment": (74, 92, 120),
    "lane": (112, 130, 156),
    "ped_crossing": (196, 202, 210),
    "stop_line": (213, 94, 0),
    "lane_divider": TEXT,
    "road_divider": YELLOW,
}
"""Later ones lie on top."""
FUTURE_COLOUR: Colour = (70, 78, 90)
_CYCLE = (ORANGE, SKY_BLUE, GREEN, YELLOW, PURPLE, (213, 94, 0), (120, 150, 255))
"""Of classes and of instances."""
_ARROW_M = 0.2
"""Shorter ways of a centre are not drawn."""


def draw_map(view: View, plan: Plan) -> Canvas:
    """Layers under classes; without classes, under vehicles."""
    colours = _ground(plan)
    for layer, colour in LAYER_COLOURS.items():
        colours[_mask(view, f"layers/{layer}")] = colour
    for name, colour in class_colours(view).items():
        colours[_mask(view, f"classes/{name}")] = colour
    if not class_colours(view):
        colours[view.vehicles > 0] = VEHICLE_COLOUR
    return draw_plane(colours, plan)


def draw_instances(view: View, plan: Plan) -> Canvas:
    """Instances, each in a colour that it keeps, over where vehicles will be; and where centres move."""
    colours = _ground(plan)
    colours[view.drivable > 0] = DRIVABLE_COLOUR
    for later in view.further.get("future/vehicles", ()):
        colours[later > 0] = FUTURE_COLOUR
    numbers = view.further.get("instances/id", view.vehicles)
    there = numbers > 0
    colours[there] = np.array(_CYCLE, np.uint8)[numbers[there] % len(_CYCLE)]
    canvas = draw_plane(colours, plan)
    for ways in _ways(view, plan):
        canvas.polyline(plan.pixels(ways), TEXT)
        canvas.dots(plan.pixels(ways[1:]), TEXT, 2.0)
    return canvas


def class_colours(view: View) -> dict[str, Colour]:
    """Class → its colour, in the shard's order."""
    names = (name.removeprefix("classes/") for name in view.further if name.startswith("classes/"))
    return {name: _CYCLE[place % len(_CYCLE)] for place, name in enumerate(names)}


def _ways(view: View, plan: Plan) -> Iterator[FloatArray]:
    """(2, 2) from and to where the mean of each instance's cells moves, metres, level frame."""
    flow = view.further.get("instances/flow")
    if flow is None:
        return
    numbers = view.further["instances/id"]
    known = (numbers > 0) & np.isfinite(flow[0])
    for number in np.unique(numbers[known]):
        rows, columns = np.nonzero(known & (numbers == number))
        middle = plan.grid.positions_m(np.array([columns.mean(), rows.mean()]))
        way = flow[:, rows, columns].mean(axis=1)
        if np.hypot(*way) >= _ARROW_M:
            yield np.array([middle, middle + way], dtype=np.float64)


def _ground(plan: Plan) -> UInt8Array:
    return np.full((*plan.grid.shape, 3), GROUND_COLOUR, dtype=np.uint8)


def _mask(view: View, name: str) -> "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]":
    """Nowhere, where the shard has no such raster."""
    return np.asarray(view.further.get(name, np.zeros_like(view.vehicles)) > 0, dtype=np.bool_)
