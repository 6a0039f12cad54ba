"""Every stage-1 system on one synthetic world with hills: trained, evaluated, one table (takes hours).

`python benchmarks/perception.py [FOLDER]`: what is there is kept, so a run that was cut short goes on.
The world, the sizes and the epochs are constants below; they fit two cores.
"""

import sys
import time
from pathlib import Path

import numpy as np
from commands import divide, ogmkit, told, train_all

from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.formats import as_markdown
from ogmkit.homography.leave_out import RANGES_M, summarise
from ogmkit.learn.predict.homographies import measured
from ogmkit.learn.predict.run import open_run
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.pipeline.homography_summary import read_results
from ogmkit.shards.reader import Shard

CAMERA = "CAM_FRONT"
SCENES, FRAMES, SEED = 56, 20, 11
VAL, TEST = 6, 10  # scenes that choose the best checkpoint, and that the tables are about
WORLD = ["--num-scenes", SCENES, "--frames", FRAMES, "--seed", SEED, "--relief", 2, "--camera", CAMERA]
WORLD += ["--scenes-per-log", 1]
COMMON = ["--encoder", "resnet18", "--workers", 0, "--flip", 0.5]
COMMON += ["--optimizer", "adamw", "--schedule", "cosine"]
IMAGES = [*COMMON, "--image-size", "96x160", "--colour", 0.2]
# OFT's loss is a sum over cells, which AdamW's steps don't notice: the same learning rate serves.
LONG = ["--lr", 1e-3, "--epochs", 6]
MASKS = [*IMAGES, *LONG]
TRAININGS = {
    "homography": ["homography", *IMAGES, "--lr", 5e-4, "--epochs", 4],
    "homography-four-point": [
        *("homography", *IMAGES, "--lr", 5e-4, "--epochs", 8),
        *("--pitch", 2, "--roll", 1, "--head", "four-point"),
    ],
    "bev-lidar": ["bev-lidar", *COMMON, *LONG, "--bev-cell", 0.5],
    "oft": ["oft", *MASKS, "--channels", 32, "--blocks", 2],
    "ved": ["ved", *MASKS, "--bev-cell", 1.0],
    **{f"footprints-{seed}": ["footprints", *MASKS, "--seed", seed] for seed in range(3)},
    **{
        f"full-body-{seed}": ["footprints", *MASKS, "--seed", seed, "--masks", "full-body"]
        for seed in range(3)
    },
}
NETWORKS = {"homography": "network", "homography-four-point": "network-four-point"}
"""Runs of homography and what their predictions are called; `network` is what masks are warped by."""


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".bench/perception")
    folder.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    shards = make_shards(folder)
    splits, division = divide(folder, shards, VAL, TEST)
    first = {name: options for name, options in TRAININGS.items() if name in NETWORKS}
    seconds = train_all(folder, shards, splits, first)
    for name, source in NETWORKS.items():
        ogmkit("predict", "homography", shards, "--checkpoint", folder / name, "--name", source)
    ogmkit("render-footprints", shards, "--homography", "network", "--scale", 1)
    rest = {name: options for name, options in TRAININGS.items() if name not in NETWORKS}
    seconds |= train_all(folder, shards, splits, rest)
    runs = [folder / name for name in rest]
    found = evaluate(shards, [open_run(run) for run in runs], split_file=splits)
    print(as_markdown(found))
    print(homography_table(shards, division))
    print(f"\nSeconds of each training, a core each: {told(seconds)}")
    print(f"In all {(time.monotonic() - started) / 3600:.2f} h (this run; what was there was kept)")


def make_shards(folder):
    world, shards = folder / "world", folder / "shards"
    if not world.exists():
        ogmkit("synthesize", world, *WORLD, "--image-size", "180x320")
    ogmkit("extract", world, shards, "--lidar", "--workers", 2, "--cache-dir", folder / "cache")
    ogmkit("homography-fit", shards, "--workers", 2)
    ogmkit("render-footprints", shards, "--scale", 1, "--workers", 2)
    ogmkit("render-footprints", shards, "--scale", 1, "--method", "full-body", "--workers", 2)
    return shards


def homography_table(shards, division):
    """Errors of boxes of reported scenes, by range: each left out of the fit, or unknown to the network."""
    test = division.test
    found = {source: read(shards, test, source) for source in ("surface", "dlt", "calibration")}
    found["training set's mean"] = mean_errors(shards, division.train, test)
    found |= {name: read(shards, test, source) for name, source in NETWORKS.items()}
    header = " | ".join(f"{low:.0f}–{high:.0f} m" for low, high in RANGES_M)
    lines = [
        f"Error of vehicles' ground corners on the {len(test)} scenes of test, m: median / 90th percentile",
        "",
        f"| homography | {header} |",
        "| --- |" + " --- |" * len(RANGES_M),
    ]
    for name, errors in found.items():
        cells = (f"{one.median_m:.2f} / {one.p90_m:.2f} ({one.boxes})" for one in summarise(errors))
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def read(shards, scenes, source):
    """Errors as the shards have them."""
    for scene in scenes:
        with Shard(shards / f"{scene}.h5") as shard:
            yield read_results(shard, CAMERA, source).left_out


def mean_errors(shards, train, test):
    """Errors of one homography for all frames: the mean of the training scenes' `surface`."""
    matrices = []
    for scene in train:
        with Shard(shards / f"{scene}.h5") as shard:
            group = shard.h5[f"{CAMERA}/homography/surface"]
            matrices.append(group["bev_from_image"][:][group["valid"][:]])
    mean = np.concatenate(matrices).mean(axis=0)
    for scene in test:
        with Shard(shards / f"{scene}.h5") as shard:
            for frame in range(shard.frames(CAMERA)):
                yield measured(mean, frame_geometry(shard, CAMERA, frame), shard.grid)[1]


if __name__ == "__main__":
    main()
