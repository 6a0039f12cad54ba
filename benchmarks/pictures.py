"""The pictures of docs/ that need trained networks: runs of bench-learn and bench-plan on held-out scenes.

`python benchmarks/pictures.py` after both; `make pictures` makes the others.
"""

import argparse
import json
import sys
from pathlib import Path

import learn_tables
import plan_tables
from bench_command import RESULTS
from bench_data import CAMERA, PLAN_GRID
from bench_parts import Bench
from commands import ogmkit

sys.path.append(str(Path(__file__).resolve().parents[1] / "docs"))
from make_pictures import keep

MASKS, PLANS = "flat/footprints-0", "masks/mid-to-end-linear-0"
SCENES, SEED = 4, 101
"""Of a world with images that no benchmark has."""


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--learn", type=Path, default=Path(".bench/learn"), help="the folder of bench-learn")
    parser.add_argument("--plan", type=Path, default=Path(".bench/plan"), help="the folder of bench-plan")
    parser.add_argument("--folder", type=Path, default=Path(".bench/pictures"), help="where sheets are kept")
    options = parser.parse_args(arguments)
    run, data = parts(options.learn, learn_tables, MASKS, "flat/data")
    ogmkit(
        *("evaluate", data / "shards", run / "run", "--split-file", data / "splits.json"),
        *("--split", "test", "--pictures", options.folder),
    )
    keep(options.folder / "footprints.png", "evaluation.jpg", width=1150)
    shards, splits = world(options.folder / "world")
    (run,) = parts(options.plan, plan_tables, PLANS)
    ogmkit(
        *("evaluate", shards, run / "run", "--split-file", splits, "--split", "test"),
        *("--pictures", options.folder),
    )
    keep(options.folder / "mid-to-end-plans.png", "plans.jpg")


def parts(folder, tables, *names):
    """Folders of a benchmark's parts.

    Raises:
        SystemExit: one has not been made.
    """
    bench = Bench(folder, RESULTS / tables.NAME, tuple(tables.parts_of(toy=False)))
    found = [bench.at(name) for name in names]
    for path in found:
        if not path.is_dir():
            sys.exit(f"{path} is missing; make bench-{tables.NAME} first")
    return found


def world(folder):
    """Shards of scenes with incidents and images on the planners' grid, and a split file: all are tests."""
    data, shards, splits = (folder / name for name in ("data", "shards", "splits.json"))
    if not data.exists():
        ogmkit(
            *("synthesize", data, "--num-scenes", SCENES, "--seed", SEED, "--incidents", "--frames", 24),
            *("--image-size", "225x400", "--camera", CAMERA, "--no-lidar", "--scenes-per-log", 1),
            *("--annotate-by", "rendered"),
        )
    ogmkit("extract", data, shards, *PLAN_GRID)
    ogmkit("homography-fit", shards, "--method", "surface")
    names = [path.stem for path in sorted(shards.glob("scene-*.h5"))]
    splits.write_text(json.dumps({"test": names}))
    return shards, splits


if __name__ == "__main__":
    main()
