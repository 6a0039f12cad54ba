"""A frame's drivable raster: ogmkit against the official devkit's two ways."""

import json
import tempfile
from pathlib import Path

import numpy as np
from measure import show, side_by_side
from nuscenes.map_expansion.map_api import NuScenesMap
from nuscenes.utils.map_mask import MapMask
from PIL import Image
from tiling import tiled

from ogmkit.geometry.se3 import heading_rad, inverse, level_from_global, transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.raster.drivable import drivable_mask
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings

FRAMES = 10
REPEATS = 15
TILES = (4, 5)
"""Copies east and north: a map of singapore-onenorth's size, which is 1586 m × 2025 m."""
SETTINGS = SynthesisSettings(
    scenes=1, frames=FRAMES, cameras=("CAM_FRONT",), image_size=(90, 160), lidar=False
)


def main():
    with tempfile.TemporaryDirectory() as folder:
        small, large = Path(folder) / "small", Path(folder) / "large"
        synthesize(small, SETTINGS)
        with Dataset(small) as dataset:
            frames = dataset.scene(dataset.scene_names()[0], ("CAM_FRONT",)).cameras["CAM_FRONT"]
        location, poses = frames[0].location, np.stack([frame.global_from_ego for frame in frames])
        mask = small / frames[0].map_path
        tile_m = tile_map(mask, small, large, location)
        compare("one synthesized map", small, location, mask, poses)
        poses[:, :2, 3] += np.multiply(tile_m, np.array(TILES) // 2)
        compare("map of a real one's size (that map, tiled)", large, location, large / "mask.png", poses)


def tile_map(mask, source, destination, location):
    """Repeat a map's mask and drivable polygons; returns the size of a tile in metres."""
    pixels = np.asarray(Image.open(mask))
    (destination / "maps" / "expansion").mkdir(parents=True)
    Image.fromarray(np.tile(pixels, TILES[::-1])).save(destination / "mask.png")
    name = f"maps/expansion/{location}.json"
    layers = json.loads((source / name).read_text(encoding="utf-8"))
    size_m = np.array(pixels.shape[::-1]) / 10
    (destination / name).write_text(json.dumps(tiled(layers, size_m, TILES)), encoding="utf-8")
    return size_m


def compare(title, root, location, png, poses):
    grid, levels = GridSpec(), level_from_global(poses)
    ours, devkits = MaskStore(root / "cache").open(png), MapMask(str(png))
    vector_map = NuScenesMap(str(root), location)
    centres = cell_centres(grid)
    points = [moved(centres, level) for level in levels]  # made beforehand: only the look-up is timed
    ways = {
        "MapMask.is_on_mask, warm": lambda: [devkits.is_on_mask(*xy).reshape(grid.shape) for xy in points],
        "NuScenesMap.get_map_mask": lambda: [devkit_patch(vector_map, grid, pose) for pose in poses],
        "ogmkit": lambda: [drivable_mask(grid, level, ours) for level in levels],
    }
    results = {name: np.stack(way()).astype(bool) for name, way in ways.items()}
    seconds = side_by_side(ways, REPEATS)
    rows = [
        (
            name,
            f"{1e3 * seconds[name] / len(poses):.2f} ms",
            f"{seconds[name] / seconds['ogmkit']:.1f}×",
            f"{np.mean(results[name] == results['MapMask.is_on_mask, warm']):.3%}",
        )
        for name in ways
    ]
    size = " × ".join(map(str, ours.shape))
    show(
        f"Drivable raster of a frame, 1000 × 550 cells, {title}, {size} px",
        ("", "time", "to ogmkit's", "cells as is_on_mask"),
        rows,
    )


def cell_centres(grid):
    """(2, N) x and y of all cells' centres in the level frame."""
    rows, columns = np.indices(grid.shape)
    return grid.positions_m(np.stack([columns.ravel(), rows.ravel()], axis=-1)).T.copy()


def moved(centres_level, level):
    """(2, N) x and y in the global frame, with no more arithmetic than that takes."""
    global_from_level = inverse(level)
    return global_from_level[:2, :2] @ centres_level + global_from_level[:2, 3:]


def devkit_patch(vector_map, grid, global_from_ego):
    """The grid's patch as the devkit draws it, turned to ogmkit's row order."""
    (x0, x1), (y0, y1) = grid.x_range_m, grid.y_range_m
    middle = np.array([[(x0 + x1) / 2, (y0 + y1) / 2, 0]])
    middle = transform_points(inverse(level_from_global(global_from_ego)), middle)[0]
    angle = np.degrees(heading_rad(global_from_ego)) - 90
    patch = (middle[0], middle[1], x1 - x0, y1 - y0)
    return vector_map.get_map_mask(patch, angle, ["drivable_area"], grid.shape)[0, ::-1]


main()
