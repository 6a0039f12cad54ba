"""Map expansion files, version 1.3: the layers that the official devkit's `NuScenesMap` reads.

Layers and fields: nuScenes map expansion tutorial.
"""

import json
from pathlib import Path

import numpy as np
from shapely.geometry import Polygon

from ogmkit.synthetic.arclines import arcline_path
from ogmkit.synthetic.junctions import between
from ogmkit.synthetic.layout import Layout, lane_divider_lines, road_divider_lines
from ogmkit.synthetic.mapgraph import MapGraph, Record
from ogmkit.synthetic.maplights import traffic_lights
from ogmkit.synthetic.oddareas import odd_walkways
from ogmkit.synthetic.streets import Lane
from ogmkit.typing import FloatArray

_VERSION = "1.3"


def write_expansion(path: Path, layout: Layout, seed: int, *, odd_areas: bool = False) -> None:
    """Write the map expansion of one location: the polygons of its mask, lanes, and what belongs to them.

    Args:
        path: of the file.
        layout: of the location.
        seed: of the dataset.
        odd_areas: whether there are walkways of odd shape besides.
    """
    graph = MapGraph(seed, layout.location.name)
    layers = {
        **_areas(graph, layout, odd_walkways(layout.network) if odd_areas else []),
        **_roads(graph, layout),
        **_markings(graph, layout),
        **_lanes(graph, layout),
        "traffic_light": traffic_lights(graph, layout),
    }
    content = {
        "version": _VERSION,
        "canvas_edge": list(layout.location.size_m),
        "node": graph.node,
        "line": graph.line,
        "polygon": graph.polygon,
        **layers,
    }
    path.write_text(json.dumps(content, separators=(",", ":"), allow_nan=False), encoding="utf-8")


def _areas(graph: MapGraph, layout: Layout, odd: list[Polygon]) -> dict[str, list[Record]]:
    """Surfaces without direction."""
    drivable = [graph.add_polygon(area) for area in layout.layers.drivable.geoms]
    walkways = [graph.add_polygon(area) for area in [*layout.layers.walkway.geoms, *odd]]
    car_parks: list[Record] = [
        {
            "token": graph.token("carpark_area", number),
            "polygon_token": graph.add_polygon(park.area),
            "orientation": park.heading_rad,
            "road_block_token": "",
        }
        for number, park in enumerate(layout.car_parks)
    ]
    return {
        "drivable_area": [{"token": graph.token("drivable_area", 0), "polygon_tokens": drivable}],
        "walkway": [
            {"token": graph.token("walkway", number), "polygon_token": polygon}
            for number, polygon in enumerate(walkways)
        ],
        "carpark_area": car_parks,
    }


def _roads(graph: MapGraph, layout: Layout) -> dict[str, list[Record]]:
    """Roads and junctions, and each road's two directions."""
    areas = [*layout.road_areas, *layout.junction_areas]
    segments: list[Record] = [
        {
            "token": graph.token("road_segment", number),
            "polygon_token": graph.add_polygon(area),
            "is_intersection": number >= len(layout.road_areas),
            "drivable_area_token": graph.token("drivable_area", 0),
        }
        for number, area in enumerate(areas)
    ]
    blocks = []
    for number, road in enumerate(layout.network.roads):
        for side in (1, -1):
            inner = road.centre.offset(side * road.section.median_m / 2).simplified().points
            outer = road.centre.offset(side * road.section.half_m).simplified().points
            if side != layout.network.traffic_side:
                inner, outer = inner[::-1], outer[::-1]
            block = _directed(graph, inner, outer)
            block["token"] = graph.token("road_block", number, side)
            block["road_segment_token"] = graph.token("road_segment", number)
            blocks.append(block)
    return {"road_segment": segments, "road_block": blocks}


def _directed(graph: MapGraph, one: FloatArray, other: FloatArray) -> Record:
    """Polygon between two sides that run in the direction of travel, and its first and last edge."""
    return {
        "polygon_token": graph.add_polygon(Polygon(np.concatenate([one, other[::-1]]))),
        "from_edge_line_token": graph.add_line(np.stack([one[0], other[0]])),
        "to_edge_line_token": graph.add_line(np.stack([one[-1], other[-1]])),
    }


def _markings(graph: MapGraph, layout: Layout) -> dict[str, list[Record]]:
    """Crossings, stop lines and dividers."""
    crossings: list[Record] = [
        {
            "token": graph.token("ped_crossing", *key),
            "polygon_token": graph.add_polygon(area),
            "road_segment_token": graph.token("road_segment", key[0]),
        }
        for key, area in layout.crossings.items()
    ]
    stop_lines: list[Record] = [
        {
            "token": graph.token("stop_line", *key),
            "polygon_token": graph.add_polygon(area),
            "stop_line_type": "PED_CROSSING",
            "ped_crossing_tokens": [graph.token("ped_crossing", *key)],
            "traffic_light_tokens": [],
            "road_block_token": graph.token("road_block", key[0], _incoming_side(layout, at_end=key[1])),
        }
        for key, area in layout.stop_lines.items()
    ]
    return {"ped_crossing": crossings, "stop_line": stop_lines, **_dividers(graph, layout)}


def _dividers(graph: MapGraph, layout: Layout) -> dict[str, list[Record]]:
    """Dividers between the lanes of one direction, and between the directions."""
    lane_dividers: list[Record] = []
    road_dividers: list[Record] = []
    for number, road in enumerate(layout.network.roads):
        for line in lane_divider_lines(road):
            points = np.asarray(line.coords)
            record = graph.token("lane_divider", len(lane_dividers))
            segments = _divider_segments(graph, points, "DOUBLE_DASHED_WHITE")
            lane_dividers.append(
                {"token": record, "line_token": graph.add_line(points), "lane_divider_segments": segments}
            )
        for line in road_divider_lines(road):
            record = graph.token("road_divider", len(road_dividers))
            segment = graph.token("road_segment", number)
            line_token = graph.add_line(np.asarray(line.coords))
            road_dividers.append({"token": record, "line_token": line_token, "road_segment_token": segment})
    return {"lane_divider": lane_dividers, "road_divider": road_dividers}


def _incoming_side(layout: Layout, *, at_end: bool) -> int:
    """On which side of a road's middle line, left (+1) or right, lanes lead to one of its ends."""
    return layout.network.traffic_side if at_end else -layout.network.traffic_side


def _divider_segments(graph: MapGraph, points: FloatArray, kind: str) -> list[Record]:
    """What kind of line begins at each node; nothing begins at the last."""
    nodes = graph.add_nodes(points)
    return [
        {"node_token": node, "segment_type": kind if number < len(nodes) - 1 else "NIL"}
        for number, node in enumerate(nodes)
    ]


def _lanes(graph: MapGraph, layout: Layout) -> dict[str, object]:
    """Lanes, turns (lane connectors), their middle lines as arcs, and which leads to which."""
    network = layout.network
    tokens = [
        graph.token("lane" if lane.road >= 0 else "lane_connector", number)
        for number, lane in enumerate(network.lanes)
    ]
    lanes: list[Record] = []
    connectors: list[Record] = []
    for record, lane in zip(tokens, network.lanes, strict=True):
        if lane.road >= 0:
            lanes.append({"token": record, **_lane(graph, layout, lane)})
        else:
            half_m = lane.width_m / 2
            area = between(lane.path.offset(half_m).simplified(), lane.path.offset(-half_m).simplified())
            polygon = graph.add_polygon(area)
            ring = graph.polygon[-1]["exterior_node_tokens"]
            connectors.append(
                {"token": record, "polygon_token": polygon, "exterior_node_tokens": ring, "holes": []}
            )
    connectivity = {
        record: {
            "incoming": [tokens[other] for other in network.preceding[number]],
            "outgoing": [tokens[other] for other in network.following[number]],
        }
        for number, record in enumerate(tokens)
    }
    arcs = {record: arcline_path(lane.path) for record, lane in zip(tokens, network.lanes, strict=True)}
    return {
        "lane": lanes,
        "lane_connector": connectors,
        "arcline_path_3": arcs,
        "connectivity": connectivity,
    }


def _lane(graph: MapGraph, layout: Layout, lane: Lane) -> Record:
    """Everything of a lane but its token; its edges are its road's, so that neighbours share nodes."""
    road = layout.network.roads[lane.road]
    edges = [
        road.centre.offset(lane.side * float(road.section.lane_edges_m[lane.rank + step])).simplified().points
        for step in (0, 1)
    ]
    if lane.side != layout.network.traffic_side:
        edges = [edge[::-1] for edge in edges]
    # The inner edge is on the driver's left where traffic keeps right.
    left, right = edges if layout.network.traffic_side < 0 else edges[::-1]
    kinds = ["DOUBLE_DASHED_WHITE" if lane.rank else "NIL", "NIL"]
    if lane.rank < road.section.lanes - 1:
        kinds[1] = "DOUBLE_DASHED_WHITE"
    left_kind, right_kind = kinds if layout.network.traffic_side < 0 else kinds[::-1]
    return {
        **_directed(graph, left, right),
        "lane_type": "CAR",
        "left_lane_divider_segments": _divider_segments(graph, left, left_kind),
        "right_lane_divider_segments": _divider_segments(graph, right, right_kind),
    }
