"""Real images: networks from four starts, controls and ceilings, on scenes that taught none of them.

`python benchmarks/real.py --data DATAROOT --train scene-0103 --test scene-0523 --seeds 3 --format json`;
scenes may be repeated, and without them each scene of the dataset is the test once. `--quick`: one seed, one
way round.

Nothing is chosen on test scenes: the checkpoint is that of the last step, and the start of `full-body` and
`homography` the one whose `footprints` scored best on training frames. What is there is kept, so a run that
was cut short goes on: runs and shards in FOLDER, the figures of each part in FOLDER/results.
"""

import argparse
import contextlib
import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from real_parts import PLANNING, Way, best_start
from real_tables import summary
from real_trainings import NEED_IMAGENET, STARTS, Trainer, imagenet_weights

from ogmkit.errors import OgmkitError
from ogmkit.nuscenes.dataset import Dataset

DATA = Path("../shared/data/nuscenes-mini-images")
INTERRUPTED = 130
"""Exit code after Ctrl-C, as of shells."""


@dataclass(frozen=True)
class Sizes:
    """What decides how long it takes; the benchmark's values are the defaults."""

    steps: int = 160
    image_size: str = "224x400"
    world_scenes: int = 24
    world_steps: int = 600
    plan_scenes: int = 100
    plan_epochs: int = 20


def main(arguments=None):
    """Write the records to stdout, as JSON or as tables; what making them prints goes to stderr."""
    options = parsed(arguments)
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            records = list(records_of(options, folder))
    except OgmkitError as error:
        sys.exit(f"error: {error}")
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)  # the command has said why
    except KeyboardInterrupt:
        print("interrupted: the same command resumes", file=sys.stderr)
        sys.exit(INTERRUPTED)
    print(json.dumps(records, indent=1) if options.format == "json" else summary(records))


def parsed(arguments):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=DATA, help="a folder with v1.0-*, maps and samples")
    parser.add_argument("--folder", type=Path, default=Path(".bench/real"), help="where all is kept")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--format", choices=("json", "markdown"), default="markdown")
    parser.add_argument("--train", action="append", default=[], metavar="SCENE")
    parser.add_argument("--test", action="append", default=[], metavar="SCENE")
    parser.add_argument("--start", action="append", choices=STARTS, help="of footprints; all by default")
    parser.add_argument("--quick", action="store_true", help="one seed, one way")
    parser.add_argument("--encoder-weights", type=Path, metavar="FILE", help="ImageNet's of the encoder")
    for name, value in asdict(Sizes()).items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=type(value), default=value)
    options = parser.parse_args(arguments)
    if bool(options.train) != bool(options.test):
        parser.error("--train and --test go together")
    if options.seeds < 1:
        parser.error("--seeds must be at least 1")
    if {*options.train} & {*options.test}:
        parser.error("a scene is in --train and in --test")
    return options


def records_of(options, folder):
    """The records of every part, way by way."""
    weights = imagenet_weights(options.encoder_weights)
    starts = [one for one in options.start or STARTS if weights is not None or one not in NEED_IMAGENET]
    sizes = Sizes(**{name: getattr(options, name) for name in asdict(Sizes())})
    trainer = Trainer(folder, sizes, weights)
    seeds = range(1 if options.quick else options.seeds)
    for train, test in ways_of(options):
        way = Way(options.data, folder, trainer, tuple(train), tuple(test))
        yield from way.part("for-free", way.for_free)
        footprints = {start: [way.network("footprints", start, seed) for seed in seeds] for start in starts}
        yield from (record for parts in footprints.values() for part in parts for record in part.records)
        best = best_start(footprints)
        for system in ("full-body", "homography"):
            yield from (record for seed in seeds for record in way.network(system, best, seed).records)
        for name in PLANNING:
            yield from (record for seed in seeds for record in way.planner(name, seed).records)


def ways_of(options):
    """(train, test): what was asked for, else each scene left out once."""
    if options.train:
        return [(options.train, options.test)]
    with Dataset(options.data) as dataset:
        names = dataset.scene_names()
    ways = [([one for one in names if one != left_out], [left_out]) for left_out in names]
    return ways[:1] if options.quick else ways


if __name__ == "__main__":
    main()
