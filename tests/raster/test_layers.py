"""Map layers as cells against shapely: whole unions, and distances from lines."""

import json
import os
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import shapely

from ogmkit.errors import DataFileError
from ogmkit.geometry.se3 import inverse, level_from_global, pose_matrix, transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.expansion import LINES, Expansion, Layer, open_expansion
from ogmkit.raster.layers import layer_masks, layer_shapes, open_layers

FIXTURE = Path(__file__).resolve().parents[2] / "fixtures" / "nuscenes-synthetic"
LOCATIONS = ("boston-seaport", "singapore-onenorth")
LAYERS = get_args(Layer)
GRIDS = (GridSpec(0.25, 300, 160, 300.0, 87.0), GridSpec(0.4, 130, 180, 60.3, 31.7))
WIDTH_M = 0.7
LEAST_IOU = 0.999
ARC_M = 0.0004 * WIDTH_M / 2
"""How far corners of 32 to a quarter leave an arc's edge inside."""


def _expansion(**layers):
    """A map of polygons, given as lists of rings, and of lines, given as points: layer → several of them."""
    content = {name: [] for name in ("node", "polygon", "line", *LAYERS)}

    def nodes(points):
        tokens = [f"node {len(content['node']) + i}" for i in range(len(points))]
        rows = zip(tokens, points, strict=True)
        content["node"] += [{"token": token, "x": x, "y": y} for token, (x, y) in rows]
        return tokens

    for layer, shapes in layers.items():
        for number, shape in enumerate(shapes):
            token = f"{layer} {number}"
            if layer in LINES:
                content["line"].append({"token": token, "node_tokens": nodes(shape)})
                content[layer].append({"line_token": token})
            else:
                outer, *holes = map(nodes, shape)
                rings = [{"node_tokens": hole} for hole in holes]
                content["polygon"].append({"token": token, "exterior_node_tokens": outer, "holes": rings})
                content[layer].append({"polygon_token": token})
    return Expansion(Path("map.json"), content)


def _mask(grid, level, expansion, layer, width_m=WIDTH_M):
    return layer_masks(grid, level, {layer: layer_shapes(expansion, layer, width_m)})[layer]


def _centres(grid, level):
    """(rows, columns, 2) of cells' centres on the map."""
    rows, columns = np.indices(grid.shape)
    points = grid.positions_m(np.stack([columns.ravel(), rows.ravel()], axis=-1).astype(float))
    return transform_points(inverse(level), np.column_stack([points, 0 * points[:, 0]]))[:, :2]


def _square(low, high):
    return [(low, low), (high, low), (high, high), (low, high)]


# Cell (r, c) is at x = 9.5 − r, y = 9.5 − c of a level frame that lies as the map does.
_PLAIN = GridSpec(1.0, 10, 10, 10.0, 10.0)


def _shown(shape):
    return shapely.contains_xy(shape, *_centres(_PLAIN, np.eye(4)).T).reshape(_PLAIN.shape)


def test_polygons_that_overlap_unite_and_a_hole_is_another_s_ground():
    polygons = [[_square(1, 9), _square(3, 7)], [_square(4, 6)], [_square(0, 2)]]
    mask = _mask(_PLAIN, np.eye(4), _expansion(walkway=polygons), "walkway")
    expected = _shown(shapely.union_all([shapely.Polygon(outer, holes) for outer, *holes in polygons]))
    np.testing.assert_array_equal(mask, expected)
    assert (mask.sum(), mask[4:6, 4:6].sum()) == (64 - 16 + 4 + 3, 4)


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize(
    ("rings", "cells"),
    [
        ([_square(1, 9), _square(2, 6), _square(4, 8)], 64 - 16 - 16 + 4),  # holes that overlap
        ([_square(1, 6), _square(4, 9)], 25 - 4),  # a hole that reaches out
        ([_square(1, 5), _square(1, 5)], 0),  # all hole
        ([[(1, 1), (9, 9), (9, 1), (1, 9)]], 32),  # a bow tie
        ([[(1, 1), (9, 9), (9, 1), (1, 9)], _square(2, 8)], 32 - 18),  # the same with a hole
        ([[(1, 1), (9, 1)]], 0),
        ([_square(1, 9), [(2, 2), (3, 3)]], 64),
    ],
)  # fmt: skip
def test_rings_that_cross_are_what_set_operations_say(rings, cells, backwards):
    rings = [ring[::-1] if backwards else ring for ring in rings]
    mask = _mask(_PLAIN, np.eye(4), _expansion(lane=[rings]), "lane")
    whole = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings if len(ring) > 2]
    covered = shapely.difference(whole[0], shapely.union_all(whole[1:])) if whole else shapely.Polygon()
    border = np.isclose(shapely.distance(covered.boundary, shapely.points(_centres(_PLAIN, np.eye(4)))), 0)
    differs = (mask != _shown(covered)).ravel()
    assert not (differs & ~border).any()
    assert abs(int(mask.sum()) - cells) <= 8  # the tie's diagonals pass through centres


def test_a_line_is_as_wide_as_told_with_round_ends_and_corners():
    line = [(2.0, 2.0), (8.0, 3.0), (4.0, 7.0), (4.05, 7.1)]
    grid, level = GridSpec(0.1, 100, 100, 100.0, 100.0), np.eye(4)
    for width_m in (0.2, 1.5):
        mask = _mask(grid, level, _expansion(lane_divider=[line]), "lane_divider", width_m)
        from_line_m = shapely.distance(shapely.LineString(line), shapely.points(_centres(grid, level)))
        clear = np.abs(from_line_m - width_m / 2) > 0.0004 * width_m
        np.testing.assert_array_equal(mask.ravel()[clear], from_line_m[clear] < width_m / 2)
        assert mask.any()


def test_where_a_map_has_nothing_there_is_nothing():
    far = _expansion(lane=[[_square(500, 600)]], road_divider=[])
    assert not _mask(_PLAIN, np.eye(4), far, "lane").any()
    assert not _mask(_PLAIN, np.eye(4), far, "road_divider").any()
    assert layer_masks(_PLAIN, np.eye(4), {}) == {}


@pytest.fixture(scope="module")
def covered():
    """Location → layer → the shape that it covers, by shapely alone; of lines, the lines."""

    def union(expansion, layer):
        if layer in LINES:
            return shapely.union_all([shapely.LineString(line) for line in expansion.lines(layer)])
        rings = [shapely.Polygon(area.outer, area.holes) for area in expansion.areas(layer)]
        return shapely.union_all(shapely.make_valid(rings))  # some cross or touch themselves

    expansions = {location: open_expansion(FIXTURE, location) for location in LOCATIONS}
    return {
        location: {layer: union(expansion, layer) for layer in LAYERS}
        for location, expansion in expansions.items()
    }


@pytest.mark.sampled(8)
@pytest.mark.parametrize("seed", range(200))
def test_random_poses_agree_with_shapely(covered, seed):
    generator = np.random.default_rng(seed)
    location, grid = LOCATIONS[seed % 2], GRIDS[seed // 2 % 2]
    heading = generator.uniform(-np.pi, np.pi)
    tilted = [np.cos(heading / 2), *generator.normal(0, 0.02, 2), np.sin(heading / 2)]
    level = level_from_global(pose_matrix([*generator.uniform(0, 380, 2), 1.0], tilted))
    centres = _centres(grid, level)
    points = shapely.points(centres)
    masks = layer_masks(grid, level, open_layers(FIXTURE, location, LAYERS, WIDTH_M))
    assert list(masks) == list(LAYERS)
    both = either = 0
    for layer, mask in masks.items():
        shape, found = covered[location][layer], mask.ravel() > 0
        if layer in LINES:
            shapely.prepare(shape)
            less, expected, more = (
                shapely.dwithin(shape, points, WIDTH_M / 2 + by) for by in (-ARC_M, 0, ARC_M)
            )
            clear = less == more
        else:
            expected, clear = shapely.contains_xy(shape, *centres.T), True
        assert not ((found != expected) & clear).any(), layer
        both, either = both + (found & expected).sum(), either + (found | expected).sum()
    assert both >= LEAST_IOU * either


def test_a_map_is_read_again_only_when_it_has_changed(tmp_path):
    path = tmp_path / "maps" / "expansion" / "here.json"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps(_expansion(lane=[[_square(1, 9)]]).content))
    first = open_layers(tmp_path, "here", ("lane",), 1.0)
    assert open_layers(tmp_path, "here", ("lane",), 1.0) is first
    os.utime(path, ns=(1, 1))
    assert open_layers(tmp_path, "here", ("lane",), 1.0) is not first


def test_a_node_that_is_not_finite_is_damage():
    expansion = _expansion(lane=[[[(1.0, 1.0), (2.0, float("nan")), (3.0, 1.0)]]])
    with pytest.raises(DataFileError, match=r"map\.json: layer lane is absent or damaged"):
        layer_shapes(expansion, "lane", 1.0)
