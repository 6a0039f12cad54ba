"""Parts that score grids and homographies: counts by scene, so that rows can be compared."""

import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path

import numpy as np
from bench_data import CAMERA, data_of, scenes_of, train
from commands import ogmkit_here
from turned_world import write_turned

from ogmkit.base.atomic import write_json
from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.learn.predict.homographies import measured
from ogmkit.learn.predict.run import open_run
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.pipeline.homography_summary import read_results
from ogmkit.shards.reader import Shard

MEAN = "training set's mean"
NETWORK = "network"
ALONE, AMONG_ALL = "alone", "among all"
"""How the scenes of a training by heart were learnt."""


def make_grids(bench, part):
    """Train a system and score its grids on the scenes to report."""
    return score_grids(bench, part, [train(bench, part)], ceilings=())


def make_by_heart(bench, part):
    """Train a system on a few of its scenes alone; score it there, beside the one that learnt all of them."""
    scenes = scenes_of(bench, part)
    few = scenes["train"][: part.settings["scenes"]]
    taught, told = (bench.at(part.name) / name for name in ("splits.json", "reported.json"))
    taught.parent.mkdir(parents=True, exist_ok=True)
    write_json(taught, scenes | {"train": few})
    write_json(told, {"test": few})
    runs = [train(bench, part, splits=taught), bench.at(part.settings["network"]) / "run"]
    scored = score_grids(bench, part, runs, ceilings=(), splits=told)["counts"]
    return {"scenes": few, "counts": dict(zip((ALONE, AMONG_ALL), scored.values(), strict=True))}


def make_free(bench, part):
    """Rows that need no training: controls, ceilings, and errors of homographies."""
    shards, _ = data_of(bench, part)
    scenes = scenes_of(bench, part)
    sources = part.settings["sources"].split(",")
    errors = {source: errors_of(shards, scenes["test"], source) for source in sources}
    errors[MEAN] = errors_by(mean_homography(shards, scenes["train"]), shards, scenes["test"])
    return score_grids(bench, part, [], ceilings=None) | {"errors": errors}


def make_homography(bench, part):
    """Train a homography network; leaves shards that have its homographies, and masks made by them."""
    run, (shards, splits) = train(bench, part), data_of(bench, part)
    place = bench.at(part.name)
    out = place / "shards"
    if not out.exists():
        with tempfile.TemporaryDirectory(dir=place) as making:
            shutil.copytree(shards, Path(making) / "shards").rename(out)
    shutil.copy(splits, place)
    ogmkit_here("predict", "homography", out, "--checkpoint", run)
    ogmkit_here("render-footprints", out, "--homography", NETWORK, "--scale", 1)
    return {"errors": {NETWORK: errors_of(out, scenes_of(bench, part)["test"], NETWORK)}}


def make_turned(bench, part):
    """Errors of the network and of the mean homography where each log's camera is turned, angle by angle."""
    network, (shards, _) = bench.at(part.settings["network"]) / "run", data_of(bench, part)
    scenes = scenes_of(bench, part)
    mean = mean_homography(shards, scenes["train"])
    found = {}
    for angle in part.settings["angles_deg"]:
        place = bench.at(part.name) / f"{angle:g}"
        world, out = place / "world", place / "shards"
        shutil.rmtree(place, ignore_errors=True)
        write_turned(
            shards.parent / "world", world, scenes["test"], (angle, angle / 2), part.settings["seed"]
        )
        cache = ["--cache-dir", bench.folder / "cache"]
        ogmkit_here("extract", world, out, "--camera", CAMERA, "--scenes", ",".join(scenes["test"]), *cache)
        ogmkit_here("predict", "homography", out, "--checkpoint", network)
        found[f"{angle:g}"] = {
            NETWORK: errors_of(out, scenes["test"], NETWORK),
            MEAN: errors_by(mean, out, scenes["test"]),
        }
    return {"errors": found}


def score_grids(bench, part, runs, ceilings, splits=None):
    """Counts by scene of runs, or of the rows for free where there is none."""
    shards, all_scenes = data_of(bench, part)
    settings = EvaluateSettings(homography=part.settings["homography"], samples=0, scale=1)
    opened = [open_run(run) for run in runs]
    found = evaluate(shards, opened, settings, split_file=splits or all_scenes, ceilings=ceilings)
    names = found.systems or found.fixed
    counts = {
        name: {what: array.tolist() for what, array in asdict(found.by_scene[name]).items()} for name in names
    }
    return {
        "scenes": scenes_of(bench, part)["test"],
        "frames": found.frames,
        "foreground_iou": {name: dict(_ious(found, name)) for name in names},
        "counts": counts,
    }


def _ious(found, name):
    """`vehicles bev close fov` → IoU, for those who read the file."""
    for one in found.figures:
        if one.system == name and one.metric == "foreground_iou":
            place = f"{one.target} {one.view} {one.region} {one.cells}"
            yield place, None if np.isnan(one.value) else round(one.value, 4)


def errors_of(shards, scenes, source):
    """Errors of vehicles' ground corners, each left out of the fit, as the shards have them, by scene."""
    return [_of_scene(stored_by(source, shards, scene)) for scene in scenes]


def mean_homography(shards, scenes):
    """(3, 3) mean of the scenes' `surface`, scaled as shards have them."""
    matrices = []
    for scene in scenes:
        with Shard(shards / f"{scene}.h5") as shard:
            group = shard.h5[f"{CAMERA}/homography/surface"]
            matrices.append(group["bev_from_image"][:][group["valid"][:]])
    return np.concatenate(matrices).mean(axis=0)


def errors_by(bev_from_image, shards, scenes):
    """Errors of one homography for all frames, by scene."""
    return [_of_scene(measured_by(bev_from_image, shards, scene)) for scene in scenes]


def measured_by(bev_from_image, shards, scene):
    """How far one homography puts each frame's boxes from where they are."""
    with Shard(shards / f"{scene}.h5") as shard:
        frames = range(shard.frames(CAMERA))
        return [
            measured(bev_from_image, frame_geometry(shard, CAMERA, frame), shard.grid)[1] for frame in frames
        ]


def stored_by(source, shards, scene):
    """The same of a source's own homographies, each box left out of the fit, as the shard has it."""
    with Shard(shards / f"{scene}.h5") as shard:
        return [read_results(shard, CAMERA, source).left_out]


def _of_scene(left_out):
    """Ranges and errors in metres of a scene's measured boxes; null where there is none, or no bound."""
    range_m, error_m = (
        np.concatenate([getattr(one, name)[one.evaluated] for one in left_out])
        for name in ("range_m", "error_m")
    )
    errors = [round(value, 3) if np.isfinite(value) else None for value in error_m.tolist()]
    return {"range_m": range_m.round(2).tolist(), "error_m": errors}
