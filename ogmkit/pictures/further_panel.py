"""Planes of what a shard holds beside the paper's targets: layers, classes, instances, what follows."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import Plan, draw_plane
from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.further_cells import class_colours, draw_way, instance_colours, layer_colours
from ogmkit.drawing.sheet import Panel
from ogmkit.pictures.views import View
from ogmkit.typing import FloatArray

_LAYERS, _CLASSES = "layers/", "classes/"
_INSTANCES = frozenset(("instances/id", "future/vehicles"))
_SHORTEST_M = 0.2
"""Shorter ways of a centre are not drawn."""


def further_panels(view: View, plan: Plan) -> Iterator[Panel]:
    """Map layers; classes; instances and what follows: a plane for each that the shard has."""
    layers, classes = _below(_LAYERS, view.further), _below(_CLASSES, view.further)
    if layers:
        shown = {name: view.further[_LAYERS + name] for name in layers}
        yield Panel(draw_plane(layer_colours(shown, view.field_of_view), plan).pixels, "map layers")
    if classes:
        masks = [view.further[_CLASSES + name] for name in classes]
        colours = class_colours(masks, view.drivable, view.field_of_view)
        yield Panel(draw_plane(colours, plan).pixels, "classes")
    if _INSTANCES & view.further.keys():
        yield Panel(_draw_instances(view, plan).pixels, "instances")


def further_groups(rasters: Iterable[str]) -> tuple[legend.Group, ...]:
    """Groups of the legend for rasters by their names in the shard, such as `layers/lane`."""
    names = (*rasters,)
    groups = []
    if layers := _below(_LAYERS, names):
        groups.append(legend.layer_group(layers))
    if classes := _below(_CLASSES, names):
        groups.append(legend.class_group(classes))
    return (*groups, *(legend.INSTANCES,) * bool(_INSTANCES.intersection(names)))


def _below(prefix: str, names: Iterable[str]) -> list[str]:
    """What follows a prefix in the names that have it."""
    return [name.removeprefix(prefix) for name in names if name.startswith(prefix)]


def _draw_instances(view: View, plan: Plan) -> Canvas:
    """Instances over outlines of where vehicles will be, and where centres move."""
    numbers = view.further.get("instances/id", view.vehicles)
    later = np.any(view.further.get("future/vehicles", np.zeros_like(view.vehicles)[None]), axis=0)
    colours = instance_colours(numbers, later.astype(np.uint8), view.drivable, view.field_of_view)
    canvas = draw_plane(colours, plan)
    for way in _ways(view, plan):
        draw_way(canvas, plan.pixels(way))
    return canvas


def _ways(view: View, plan: Plan) -> Iterator[FloatArray]:
    """(2, 2) from and to where the mean of each instance's cells moves, metres, level frame."""
    flow: Any = view.further.get("instances/flow")
    if flow is None:
        return
    numbers = view.further["instances/id"]
    known = (numbers > 0) & np.isfinite(flow[0])
    for number in np.unique(numbers[known]):
        rows, columns = np.nonzero(known & (numbers == number))
        middle = plan.grid.positions_m(np.array([columns.mean(), rows.mean()]))
        way = flow[:, rows, columns].mean(axis=1)
        if np.hypot(*way) >= _SHORTEST_M:
            yield np.array([middle, middle + way], dtype=np.float64)
