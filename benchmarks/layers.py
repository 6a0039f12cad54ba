"""Map layers, instances, what follows: cost of a frame, speed beside the devkit, memory of a worker."""

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
from measure import run_process, show, side_by_side
from nuscenes.map_expansion.map_api import NuScenesMap
from tiling import shape_tokens, tiled

from ogmkit.geometry.se3 import heading_rad, inverse, level_from_global, transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import LINES, Layer, expansion_path
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.raster.layers import layer_masks, open_layers
from ogmkit.shards.writer import write_shard
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

FRAMES = 20
REPEATS = 15
POSES = 10
TILES = (11, 11)
"""Copies east and north: together 10,043 polygons and 2,904 lines."""
ALL = get_args(Layer)
SIX = ("drivable_area", "lane", "road_segment", "ped_crossing", "walkway", "lane_divider")
PAPER = TargetSettings()
WAYS = {
    "the paper's rasters": PAPER,
    "with six layers": replace(PAPER, layers=SIX),
    "with six layers, instances": replace(PAPER, layers=SIX, instances=True),
    "with instances, offset, flow": replace(PAPER, instances=True, flow=True),
    "with car, truck, bus": replace(PAPER, classes=("car", "truck", "bus")),
    "with three future frames": replace(PAPER, future=3),
}
OGMKIT = str(Path(sys.executable).with_name("ogmkit"))


def main():
    with tempfile.TemporaryDirectory() as folder:
        root, work = Path(folder) / "dataset", Path(folder)
        settings = SynthesisSettings(
            scenes=1, frames=FRAMES, cameras=("CAM_FRONT",), image_size=(900, 1600), lidar=False
        )
        synthesize(root, settings)
        with Dataset(root) as dataset:
            scene = dataset.scene(dataset.scene_names()[0], ("CAM_FRONT",))
        whole_frames(scene, work)
        frames = scene.cameras["CAM_FRONT"][:POSES]
        poses = np.stack([frame.global_from_ego for frame in frames])
        compare("one synthesized map", root, scene.location, poses)
        tile_m = enlarge(root, scene.location)
        poses[:, :2, 3] += np.multiply(tile_m, np.array(TILES) // 2)
        compare("map of 10,043 polygons (that map, tiled)", root, scene.location, poses)
        memory(root, work)


def whole_frames(scene, work):
    masks = MaskStore(work / "cache")
    ways = {
        name: lambda settings=settings: write_shard(
            work / "a.h5", scene, settings, masks, dataset_version="v1.0-mini"
        )
        for name, settings in WAYS.items()
    }
    seconds = side_by_side(ways, REPEATS)
    first = next(iter(seconds.values()))
    rows = [
        (name, f"{1e3 * value / FRAMES:.2f} ms", f"{value / first:.2f}×") for name, value in seconds.items()
    ]
    show("A whole frame, from record to shard (aim: six layers and instances ≤ 3×)", ("", "time", "to"), rows)


def enlarge(root, location):
    """Put the map's copies in its place; returns the size of one in metres."""
    path = expansion_path(root, location)
    layers = json.loads(path.read_text(encoding="utf-8"))
    size_m = np.array(layers["canvas_edge"])
    large = tiled(layers, size_m, TILES, ALL)
    polygons = sum(len(shape_tokens(row)) for name in ALL if name not in LINES for row in large[name])
    print(f"\n{polygons:,} polygons, {path.write_text(json.dumps(large), encoding='utf-8') / 1e6:.0f} MB")
    return size_m


def compare(title, root, location, poses):
    grid, levels = GridSpec(), level_from_global(poses)
    vector_map = NuScenesMap(str(root), location)
    ours = open_layers(root, location, ALL, 0.2)
    rows = []
    for name, layers in {"drivable_area": ALL[:1], "six layers": SIX}.items():
        chosen = {layer: ours[layer] for layer in layers}
        ways = {
            "devkit": lambda layers=layers: [devkit_patch(vector_map, grid, pose, layers) for pose in poses],
            "ogmkit": lambda chosen=chosen: [layer_masks(grid, level, chosen) for level in levels],
        }
        seconds = side_by_side(ways, REPEATS // 3)
        devkit, own = (1e3 * value / len(poses) for value in seconds.values())
        rows.append((name, f"{devkit:.2f} ms", f"{own:.2f} ms", f"{devkit / own:.0f}×"))
    show(f"Layers of a frame, 1000 × 550 cells, {title}", ("", "get_map_mask", "ogmkit", "faster"), rows)


def devkit_patch(vector_map, grid, global_from_ego, layers):
    """The grid's patch as the devkit draws it."""
    (x0, x1), (y0, y1) = grid.x_range_m, grid.y_range_m
    middle = np.array([[(x0 + x1) / 2, (y0 + y1) / 2, 0]])
    middle = transform_points(inverse(level_from_global(global_from_ego)), middle)[0]
    angle = np.degrees(heading_rad(global_from_ego)) - 90
    return vector_map.get_map_mask((middle[0], middle[1], x1 - x0, y1 - y0), angle, list(layers), grid.shape)


def memory(root, work):
    """Peak of the whole command in one process."""
    extract = [OGMKIT, "extract", str(root), str(work / "shards"), "--no-map", "--images", "none"]
    rows = []
    for name, options in {"no layer": [], "all nine": ["--layers", ",".join(ALL)]}.items():
        seconds, peak = run_process([*extract, *options, "--overwrite"])
        rows.append((name, f"{seconds:.1f} s", f"{peak:.0f} MiB"))
    show("ogmkit extract with that map, one worker (aim: < 600 MB)", ("layers", "time", "peak"), rows)


main()
