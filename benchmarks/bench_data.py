"""Synthetic worlds of the benchmarks in parts: shards, masks, and which scenes are for what."""

import json

from commands import ogmkit_here

from ogmkit.base.atomic import write_json
from ogmkit.shards.manifest import read_manifest

CAMERA = "CAM_FRONT"
PLAN_GRID = ["--cell-size", 0.5, "--rows", 80, "--columns", 48, "--ego-row", 80, "--ego-column", 24]
"""Of planners, which see the masks in parts of 2 m anyway."""


def world_settings(
    *, split, frames, seed, image_size, annotate_by="rendered", more=(), extract=(), sources="", masks=()
):
    """Settings of a part that makes a world: a log for every scene.

    Args:
        split: scenes to learn from, to choose checkpoints by, and to report.
        frames: of each scene.
        seed: of the world.
        image_size: that is rendered.
        annotate_by: `rendered`, so that there is what the camera sees, or `all`.
        more: options of `synthesize`.
        extract: options of `extract`.
        sources: methods of `homography-fit`; empty for none.
        masks: methods of `render-footprints`.
    """
    synthesize = ["--num-scenes", sum(split), "--frames", frames, "--seed", seed, "--image-size", image_size]
    synthesize += ["--camera", CAMERA, "--scenes-per-log", 1, "--annotate-by", annotate_by, *more]
    made = {"synthesize": synthesize, "extract": [*extract], "sources": sources, "masks": [*masks]}
    return {"seed": seed, "split": [*split], **made}


def make_world(bench, part):
    """Make a world's shards; tells its scenes by what they are for."""
    place, settings = bench.at(part.name), part.settings
    world, shards = place / "world", place / "shards"
    if not world.exists():
        ogmkit_here("synthesize", world, *settings["synthesize"])
    cache = ["--cache-dir", bench.folder / "cache"]
    ogmkit_here("extract", world, shards, "--camera", CAMERA, *settings["extract"], *cache)
    if settings["sources"]:
        ogmkit_here("homography-fit", shards, "--method", settings["sources"])
    for method in settings["masks"]:
        ogmkit_here("render-footprints", shards, "--scale", 1, "--method", method)
    names = [entry.scene for entry in read_manifest(shards).shards]
    train, val, _ = settings["split"]
    splits = {"train": names[:train], "val": names[train : train + val], "test": names[train + val :]}
    write_json(place / "splits.json", splits)
    return {"scenes": splits}


def data_of(bench, part):
    """The shards that a part reads, and its split file."""
    place = bench.at(part.settings["data"])
    return place / "shards", place / "splits.json"


def scenes_of(bench, part):
    """Split → scenes that a part is about."""
    return json.loads(data_of(bench, part)[1].read_text(encoding="utf-8"))


def train(bench, part, *more, splits=None):
    """The RUN of a part's training, which resumes where it was cut short.

    Args:
        bench: the parts.
        part: whose settings have `train`, a system and its options, a `seed`, and perhaps `begins_with`, the
            part whose network it goes on from.
        more: options that name files.
        splits: another split file than the shards'.
    """
    shards, all_scenes = data_of(bench, part)
    run, (system, *options) = bench.at(part.name) / "run", part.settings["train"]
    where = ["--out", run, "--split-file", splits or all_scenes, "--seed", part.settings["seed"]]
    if "begins_with" in part.settings:
        where += ["--init", bench.at(part.settings["begins_with"]) / "run"]
    ogmkit_here("train", system, shards, *where, *options, *more)
    return run
