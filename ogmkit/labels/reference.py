"""The definitions as documentation: all fields of all names side by side."""

from collections.abc import Callable

from ogmkit.labels.catalogue import definition
from ogmkit.labels.definition import Axis, Definition
from ogmkit.labels.names import NAMES

_COORDINATES = {
    "lidar-heading": {"x": "right", "y": "ahead"},
    "camera": {"x": "right", "z": "ahead"},
}
"""Frame → which way its coordinates grow; of all others, x is ahead and y left."""


def definitions_markdown() -> str:
    """Two Markdown tables: the fields of each definition, and its classes."""
    drawn = [definition(name) for name in NAMES]
    header = f"| field | {' | '.join(f'`{one.name}`' for one in drawn)} |"
    rule = "| --- |" + " --- |" * len(drawn)
    rows = [f"| {name} | {' | '.join(map(shown, drawn))} |" for name, shown in _FIELDS.items()]
    return "\n".join([header, rule, *rows, "", *_class_lines(drawn)]) + "\n"


def _class_lines(drawn: list[Definition]) -> list[str]:
    lines = ["| definition | class | is made of |", "| --- | --- | --- |"]
    for whole in drawn:
        for one in whole.classes:
            of_layers = f"layers {', '.join(one.layers)}" if one.layers else ""
            of_classes = f"classes {', '.join(one.unites)}" if one.unites else ""
            boxes = "boxes `" + one.categories.replace("|", "\\|") + "`" if one.categories else ""
            lines.append(f"| `{whole.name}` | `{one.name}` | {of_layers or of_classes or boxes} |")
    return lines


def _axis(definition: Definition, axis: Axis) -> str:
    """Where the first and last nominal cells' centres lie."""
    ways = _COORDINATES.get(definition.frame, {"x": "ahead", "y": "left"})
    last = axis.first_m + axis.step_m * (axis.cells - 1)
    return f"{axis.cells}, {ways[axis.coordinate]} {axis.first_m:g} … {last:g} m"


_FIELDS: dict[str, Callable[[Definition], str]] = {
    "version": lambda one: str(one.version),
    "frame": lambda one: one.frame,
    "rows: centres": lambda one: _axis(one, one.grid.rows),
    "columns: centres": lambda one: _axis(one, one.grid.columns),
    "cell": lambda one: f"{abs(one.grid.rows.step_m):g} m",
    "fill": lambda one: one.cell.fill,
    "an index stands for (cells)": lambda one: f"centre {one.cell.index_at:+g}",
    "picture drawn in": lambda one: one.cell.drawn,
    "map layers": lambda one: one.cell.layers,
    "least visibility": lambda one: str(one.filters.min_visibility),
    "unknown counts as": lambda one: str(one.filters.unknown_visibility),
    "least LiDAR points": lambda one: str(one.filters.min_lidar_points),
    "beside the classes": lambda one: ", ".join(one.beside) or "–",
    "occlusion": lambda one: one.occlusion,
    "time of the boxes": lambda one: one.time,
    "split": lambda one: one.split,
    "cells that count": lambda one: one.counted,
    "metric": lambda one: one.metric,
    "source": lambda one: one.source or "–",
}
"""Field → how it is shown."""
