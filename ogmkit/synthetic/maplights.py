"""Traffic lights of a map expansion: one at the far side of each way into the middle junction."""

import numpy as np

from ogmkit.synthetic.layout import Layout
from ogmkit.synthetic.mapgraph import MapGraph, Record
from ogmkit.synthetic.network import HUB

_HEIGHT_M = 4.5
_LAMP_STEP_M = 0.3
_COLOURS = ("RED", "YELLOW", "GREEN")


def traffic_lights(graph: MapGraph, layout: Layout) -> list[Record]:
    """The records of the `traffic_light` layer."""
    lights: list[Record] = []
    for number, road in enumerate(layout.network.roads):
        if HUB not in road.ends:
            continue
        at_end = road.ends[1] == HUB
        stop_line = np.asarray(layout.stop_lines[number, at_end].exterior.coords)[:2]
        x, y = stop_line.mean(axis=0)
        heading = float(road.centre.headings[-1 if at_end else 0]) + (np.pi if at_end else 0.0)
        side = layout.network.traffic_side if at_end else -layout.network.traffic_side
        lights.append(
            {
                "token": graph.token("traffic_light", number),
                "line_token": graph.add_line(stop_line),
                "traffic_light_type": "VERTICAL",
                "from_road_block_token": graph.token("road_block", number, side),
                "items": [_lamp(colour, rank) for rank, colour in enumerate(_COLOURS)],
                "pose": _pose(float(x), float(y), _HEIGHT_M, heading),
            }
        )
    return lights


def _lamp(colour: str, rank: int) -> Record:
    return {
        "color": colour,
        "shape": "CIRCLE",
        "rel_pos": _pose(0.0, 0.0, -rank * _LAMP_STEP_M, 0.0),
        "to_road_block_tokens": [],
    }


def _pose(x: float, y: float, z: float, heading_rad: float) -> Record:
    return {"tx": round(x, 3), "ty": round(y, 3), "tz": z, "rx": 0.0, "ry": 0.0, "rz": heading_rad}
