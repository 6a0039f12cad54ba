"""Every planner on one synthetic world of incidents: trained, evaluated beside controls, two tables (hours).

`python benchmarks/planning.py [FOLDER]`: what is there is kept, so a run that was cut short goes on.
The world, the sizes and the epochs are constants below; they fit two cores. The second table says which
planner is better where.
"""

import sys
import time
from pathlib import Path

from commands import divide, ogmkit, told, train_all
from planning_pairs import pairs_table

from ogmkit.evaluation.formats import as_markdown
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.planning.sequences import sequences_of
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.learn.predict.run import open_run

CAMERA = "CAM_FRONT"
SCENES, FRAMES, SEED = 176, 40, 23
VAL, TEST = 8, 24  # scenes that choose the best checkpoint, and that the table is about
WORLD = ["--num-scenes", SCENES, "--frames", FRAMES, "--seed", SEED, "--relief", 2, "--camera", CAMERA]
WORLD += ["--incidents", "--no-lidar", "--image-size", "180x320", "--scenes-per-log", 1]
GRID = ["--cell-size", 0.5, "--rows", 80, "--columns", 48, "--ego-row", 80, "--ego-column", 24]
COMMON = ["--workers", 0, "--flip", 0.5, "--optimizer", "adamw", "--schedule", "cosine"]
IMAGES = ["--image-size", "64x128", "--encoder", "resnet18"]
POOL = ["--pool-cells", 240]
STAGE_1 = [*COMMON, *IMAGES, "--limit-frames", 2000, "--epochs", 3]
PLAN = [*COMMON, "--lr", 3e-3, "--weight-decay", 0.1]
LONG = [*PLAN, "--epochs", 20]
SHORT = [*PLAN, "--batch-size", 4, "--epochs", 2]
SEEDS, WARP_SEEDS = range(3), range(2)


def past_planners():
    """Trainings from the past alone; the short ones see as many sequences as those from images."""
    return {
        **{f"lstm-ed-{seed}": ["lstm-ed", *LONG, "--seed", seed] for seed in SEEDS},
        **{f"lstm-ed-short-{seed}": ["lstm-ed", *SHORT, "--seed", seed] for seed in SEEDS},
    }


def mask_planners():
    """Trainings from true masks; some are short as those of the past alone."""
    return {
        **{f"mid-to-end-{seed}": ["mid-to-end", *LONG, *POOL, "--seed", seed] for seed in SEEDS},
        **{
            f"mid-to-end-np-{seed}": ["mid-to-end", *LONG, *POOL, "--seed", seed, "--no-past"]
            for seed in SEEDS
        },
        **{f"mid-to-end-short-{seed}": ["mid-to-end", *SHORT, *POOL, "--seed", seed] for seed in SEEDS},
    }


def image_planners(folder):
    """Trainings from images; those that look through footprints begin with stage 1's."""
    holistic = [*SHORT, *IMAGES, *POOL, "--perception", folder / "footprints"]
    return {
        **{f"holistic-{seed}": ["holistic", *holistic, "--seed", seed] for seed in WARP_SEEDS},
        **{f"holistic-cv-{seed}": ["holistic-cv", *holistic, "--seed", seed] for seed in WARP_SEEDS},
        "holistic-np": ["holistic", *holistic, "--no-past"],
        "end-to-end": ["end-to-end", *SHORT, *IMAGES],
        "end-to-end-np": ["end-to-end", *SHORT, *IMAGES, "--no-past"],
    }


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".bench/planning").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    shards = make_shards(folder)
    splits, _ = divide(folder, shards, VAL, TEST)
    from_past, from_masks, from_images = past_planners(), mask_planners(), image_planners(folder)
    homography = {"homography": ["homography", *STAGE_1, "--lr", 5e-4]}
    seconds = train_all(folder, shards, splits, homography | from_past)
    ogmkit("predict", "homography", shards, "--checkpoint", folder / "homography")
    ogmkit("render-footprints", shards, "--homography", "network", "--scale", 1, "--workers", 2)
    footprints = {"footprints": ["footprints", *STAGE_1, "--lr", 1e-3]}
    seconds |= train_all(folder, shards, splits, footprints | from_masks)
    seconds |= train_all(folder, shards, splits, from_images)
    runs = [folder / name for name in {**from_images, **from_past, **from_masks}]
    sequences = sequences_of(shards, split=None, split_file=splits, cameras=(), limit=None)
    settings = EvaluateSettings(samples=len(sequences))
    found = evaluate_plans(shards, [open_run(run) for run in runs], settings, split_file=splits)
    print(as_markdown(found))
    print(f"\n{pairs_table(sequences, found.samples)}")
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
