"""Every planner on one synthetic world of incidents: trained, evaluated beside controls, one table (hours).

`python benchmarks/planning.py [FOLDER]`: what is there is kept, so a run that was cut short goes on.
The world, the sizes and the epochs are constants below; they fit two cores.
"""

import json
import sys
import time
from pathlib import Path

from commands import ogmkit, told, train_all

from ogmkit.evaluation.formats import as_markdown
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.shards.manifest import read_manifest

CAMERA = "CAM_FRONT"
SCENES, FRAMES, HELD_OUT, SEED = 80, 40, 16, 23
WORLD = ["--scenes", SCENES, "--frames", FRAMES, "--seed", SEED, "--relief", 2, "--cameras", CAMERA]
WORLD += ["--incidents", "--no-lidar", "--image-size", "320x180"]
GRID = ["--cell-size", 0.5, "--rows", 200, "--columns", 110, "--ego-row", 200, "--ego-column", 60]
COMMON = ["--image-size", "64x128", "--encoder", "resnet18", "--workers", 0, "--flip", 0.5]
COMMON += ["--optimizer", "adamw", "--schedule", "cosine"]
HOMOGRAPHY = {
    "homography": ["homography", *COMMON, "--lr", 5e-4, "--epochs", 5, "--limit-frames", 1000],
}
FOOTPRINTS = {
    "footprints": ["footprints", *COMMON, "--lr", 1e-3, "--epochs", 6, "--limit-frames", 1000],
}
PLAN = [*COMMON, "--lr", 1e-3]
QUICK = [*PLAN, "--epochs", 10, "--weight-decay", 0.1]
IMAGES = [*PLAN, "--limit-frames", 480, "--batch-size", 4]
ENCODED, SEEN = [*IMAGES, "--epochs", 9], [*IMAGES, "--epochs", 4]
SEEDS = range(3)


def planners(folder):
    """Trainings of the planners; those that look through footprints begin with stage 1's."""
    holistic = [*SEEN, "--perception", folder / "footprints"]
    return {
        "end-to-end": ["end-to-end", *ENCODED],
        "end-to-end-np": ["end-to-end", *ENCODED, "--no-past"],
        "holistic": ["holistic", *holistic],
        "holistic-np": ["holistic", *holistic, "--no-past"],
        "holistic-cv": ["holistic-cv", *holistic],
        **{f"lstm-ed-{seed}": ["lstm-ed", *QUICK, "--seed", seed] for seed in SEEDS},
        **{f"mid-to-end-{seed}": ["mid-to-end", *QUICK, "--seed", seed] for seed in SEEDS},
        **{f"mid-to-end-np-{seed}": ["mid-to-end", *QUICK, "--seed", seed, "--no-past"] for seed in SEEDS},
    }


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".bench/planning").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    shards = make_shards(folder)
    splits = folder / "splits.json"
    names = [entry.scene for entry in read_manifest(shards).shards]
    splits.write_text(json.dumps({"train": names[:-HELD_OUT], "val": names[-HELD_OUT:]}))
    seconds = train_all(folder, shards, splits, HOMOGRAPHY)
    ogmkit("predict", "homography", shards, "--checkpoint", folder / "homography")
    ogmkit("render-footprints", shards, "--homography", "network", "--scale", 1)
    seconds |= train_all(folder, shards, splits, FOOTPRINTS)
    trainings = planners(folder)
    seconds |= train_all(folder, shards, splits, trainings)
    found = evaluate_plans(shards, [folder / name for name in trainings], split_file=splits)
    print(as_markdown(found))
    print(f"\nSeconds of each training, a core each: {told(seconds)}")
    print(f"In all {(time.monotonic() - started) / 3600:.2f} h (this run; what was there was kept)")


def make_shards(folder):
    world, shards = folder / "world", folder / "shards"
    if not world.exists():
        ogmkit("synthesize", world, *WORLD)
    ogmkit("extract", world, shards, *GRID, "--workers", 2, "--cache-dir", folder / "cache")
    ogmkit("homography-fit", shards, "--workers", 2)
    return shards


if __name__ == "__main__":
    main()
