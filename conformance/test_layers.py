"""Map layers against the devkit's `NuScenesMap.get_map_mask` and the mask's drivable area, at random."""

from typing import get_args

import numpy as np
import pytest
from nuscenes.map_expansion.map_api import NuScenesMap

from ogmkit.geometry.se3 import heading_rad, inverse, level_from_global, pose_matrix, transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import LINES, Layer
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.raster.drivable import drivable_mask
from ogmkit.raster.layers import layer_masks, open_layers

GRID = GridSpec(rows=600, columns=500, ego_row=600.0, ego_column=250.0)
AREAS = tuple(layer for layer in get_args(Layer) if layer not in LINES)
POSES = 8
LEAST_AGREEMENT = 0.995


@pytest.fixture(scope="module")
def places(flat_world):
    """Location → path of its mask."""
    with Dataset(flat_world.root) as dataset:
        return {
            location: flat_world.root / dataset.map_path(location)
            for location in {dataset.scene(name, []).location for name in dataset.scene_names()}
        }


def levels(number):
    """Poses about a map's middle, and their rotations."""
    generator = np.random.default_rng(number)
    half_heading = generator.uniform(-np.pi, np.pi, POSES) / 2
    positions = np.column_stack([generator.uniform(80, 300, (POSES, 2)), np.zeros(POSES)])
    nothing = np.zeros(POSES)
    poses = pose_matrix(
        positions, np.column_stack([np.cos(half_heading), nothing, nothing, np.sin(half_heading)])
    )
    return zip(poses, level_from_global(poses), strict=True)


def devkit_masks(vector_map, global_from_ego, layers):
    """(layers, rows, columns) of the grid's patch as the devkit draws it, turned to ogmkit's row order."""
    (x0, x1), (y0, y1) = GRID.x_range_m, GRID.y_range_m
    middle = np.array([[(x0 + x1) / 2, (y0 + y1) / 2, 0]])
    middle = transform_points(inverse(level_from_global(global_from_ego)), middle)[0]
    angle = np.degrees(heading_rad(global_from_ego)) - 90
    patch = (middle[0], middle[1], x1 - x0, y1 - y0)
    return vector_map.get_map_mask(patch, angle, list(layers), GRID.shape)[:, ::-1]


def at_borders(mask, reach):
    """Cells that have a cell of another value that near, or the rim, beyond which there may be one."""
    padded = np.pad(mask, reach, constant_values=2)
    rows, columns = mask.shape
    around = range(2 * reach + 1)
    windows = [padded[r : r + rows, c : c + columns] for r in around for c in around]
    return np.min(windows, axis=0) != np.max(windows, axis=0)


def test_areas_agree_with_get_map_mask_but_at_outlines(flat_world, places):
    shares = []
    for number, location in enumerate(sorted(places)):
        vector_map = NuScenesMap(str(flat_world.root), location)
        layers = open_layers(flat_world.root, location, AREAS, 1.0)
        for global_from_ego, level in levels(number):
            ours = layer_masks(GRID, level, layers)
            theirs = devkit_masks(vector_map, global_from_ego, AREAS)
            for layer, their in zip(AREAS, theirs, strict=True):
                differs = ours[layer] != their
                shares.append(np.mean(differs))
                near = at_borders(ours[layer], 2) | at_borders(their, 2)
                assert not (differs & ~near).any(), layer
    assert np.mean(np.reshape(shares, (-1, len(AREAS))), axis=0).max() <= 1 - LEAST_AGREEMENT


def test_the_drivable_layer_agrees_with_the_mask_but_at_its_outlines(flat_world, places, cache_dir):
    for number, (location, path) in enumerate(sorted(places.items())):
        layers, mask = open_layers(flat_world.root, location, AREAS[:1], 1.0), MaskStore(cache_dir).open(path)
        for _, level in levels(number):
            ours = layer_masks(GRID, level, layers)["drivable_area"]
            differs = ours != drivable_mask(GRID, level, mask)
            assert np.mean(differs) <= 1 - LEAST_AGREEMENT
            assert not (differs & ~at_borders(ours, 1)).any()


def test_lines_lie_within_the_devkit_s(flat_world, places):
    """The devkit draws them two cells thick through coordinates cut to whole cells."""
    for number, location in enumerate(sorted(places)):
        vector_map = NuScenesMap(str(flat_world.root), location)
        layers = open_layers(flat_world.root, location, LINES, 0.2)
        drawn = 0
        for global_from_ego, level in levels(number):
            ours = layer_masks(GRID, level, layers)
            for layer, their in zip(LINES, devkit_masks(vector_map, global_from_ego, LINES), strict=True):
                near = at_borders(their, 2) | (their > 0)
                assert not ((ours[layer] > 0) & ~near).any()
                drawn += int(their.sum())
        assert drawn
