"""Shards of the benchmark on real images: the dataset's own, and synthetic ones to begin with."""

import functools
import hashlib
import json
from dataclasses import replace

from bench_data import CAMERA, PLAN_GRID
from commands import ogmkit

from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.sources import RecordDataset
from ogmkit.shards.settings import ExtractSettings

SOURCE = "surface"
"""Homographies that masks are made and warped by."""
METHODS = "surface,plane,calibration,ego-plane"
SCALE = 4
"""Image size / mask size: 225 × 400."""
CHECKED = 5
"""Validation is on every fifth frame of the training scenes: it chooses nothing, and has to be quick."""
FRAMES, SEED = 20, 5
"""Of synthetic worlds."""
RENDERED = "225x400"


def real_shards(folder, data, scenes):
    """Shards of the dataset's scenes, and of some frames of each; masks of footprints and of whole bodies."""
    out = folder / f"shards-{key_of(data.resolve(), scenes)}"
    with Dataset(data) as dataset:
        version, whole = dataset.version, [dataset.scene(name, (CAMERA,)) for name in scenes]
    records = RecordDataset(data, version, (*whole, *map(checked, whole)))
    names, cache = records.scene_names(), folder / "cache"
    extract(records, out, ExtractSettings(), scenes=names, splits={}, strict=True, cache_dir=cache)
    return _with_masks(out, SCALE)


def checked(scene):
    """A few frames of a scene, as one of its own: a training needs some that it is not told to learn from."""
    name = check_name(scene.name)
    frames = tuple(replace(one, scene_name=name) for one in scene.cameras[CAMERA][::CHECKED])
    return replace(scene, name=name, cameras={CAMERA: frames})


def check_name(scene):
    """What the scene of a few frames is called."""
    return f"{scene}-check"


def real_plans(folder, data, scenes):
    """Shards of the same scenes for planners, without images."""
    out = folder / f"plans-{key_of(data.resolve(), scenes)}"
    _extract(out, data, folder, *PLAN_GRID, "--images", "none", "--scenes", ",".join(scenes))
    return out


@functools.cache
def synthetic_shards(folder, scenes):
    """Shards of a flat synthetic world, one log a scene."""
    world = folder / f"world-{scenes}"
    if not world.exists():
        ogmkit("synthesize", world, *_world(scenes), "--image-size", RENDERED)
    out = folder / f"world-shards-{scenes}"
    _extract(out, world, folder)
    return _with_masks(out, 1)


@functools.cache
def synthetic_plans(folder, scenes):
    """Shards for planners of a synthetic world of incidents, whose images are small and not kept."""
    world = folder / f"plan-world-{scenes}"
    if not world.exists():
        ogmkit("synthesize", world, *_world(scenes), "--incidents", "--image-size", "45x80")
    out = folder / f"plan-world-shards-{scenes}"
    _extract(out, world, folder, *PLAN_GRID, "--images", "none")
    return out


def write_splits(folder, train, test):
    """The split file of one way round: validation is on training frames, and chooses nothing."""
    path = folder / f"splits-{key_of(train, test)}.json"
    path.write_text(json.dumps({"train": train, "val": [*map(check_name, train)], "test": test}))
    return path


def key_of(*parts):
    """A short name of some values."""
    return hashlib.sha256(json.dumps(parts, default=str).encode()).hexdigest()[:12]


def _world(scenes):
    common = ["--frames", FRAMES, "--seed", SEED, "--camera", CAMERA, "--no-lidar", "--scenes-per-log", 1]
    return ["--num-scenes", scenes, *common, "--annotate-by", "rendered"]


def _extract(out, data, folder, *options):
    ogmkit(
        "extract", data, out, "--camera", CAMERA, "--workers", 2, "--cache-dir", folder / "cache", *options
    )


def _with_masks(out, scale):
    ogmkit("homography-fit", out, "--method", METHODS, "--workers", 2)
    for method in ("warp", "full-body"):
        ogmkit("render-footprints", out, "--scale", scale, "--method", method, "--workers", 2)
    return out
