"""Parts of the benchmark on real images: each is figures of one network, or of what needs none, in a file."""

import json
import math
import sys
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

from bench_grids import mean_homography, measured_by, stored_by
from commands import ogmkit
from real_shards import METHODS, SOURCE, key_of, real_plans, real_shards, write_splits
from real_trainings import NEED_WORLD, PLANNERS, Trainer, last, training_score

from ogmkit.base.atomic import write_json
from ogmkit.evaluation.baselines import ceiling
from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.formats import as_json
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.result import PAPER
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.homography.leave_out import summarise
from ogmkit.learn.predict.run import open_run
from ogmkit.learn.runs import BEST

PLANNING = tuple(PLANNERS)
ZERO_SHOT = "-zero-shot"
"""After a system's name: nothing real learnt."""
SHARES = {"-adapted": 1, "-half-adapted": 0.5}
"""After a system's name → how much of its normalisation is taken from the test images, without labels."""


@dataclass(frozen=True)
class Part:
    """The figures of a part.

    Attributes:
        records: as `evaluate --format json` gives them, with start, seed, train and test.
        score: on the training scenes; None of what learns nothing.
    """

    records: list
    score: float | None = None


@dataclass(frozen=True)
class Way:
    """One way round: which scenes teach, and which are reported.

    Attributes:
        data: the dataset.
        folder: of the benchmark.
        trainer: makes runs.
        train: names of scenes.
        test: names of others.
    """

    data: Path
    folder: Path
    trainer: Trainer
    train: tuple
    test: tuple

    @cached_property
    def shards(self):
        """Of all its scenes."""
        return real_shards(self.folder, self.data, sorted((*self.train, *self.test)))

    @cached_property
    def plans(self):
        """The same for planners."""
        return real_plans(self.folder, self.data, sorted((*self.train, *self.test)))

    @cached_property
    def splits(self):
        """Which of them are for what."""
        return write_splits(self.folder, self.train, self.test)

    def network(self, system, start, seed):
        """Figures of a network of the first stage."""
        return self._kept(f"{system}-{start}-{seed}", lambda: self._network(system, start, seed))

    def planner(self, name, seed):
        """Figures of a planner."""
        return self._kept(f"{name}-{seed}", lambda: self._planner(name, seed))

    def part(self, name, make):
        """The records of what needs no network."""
        return self._kept(name, make).records

    def for_free(self):
        """Controls, ceilings, errors of homographies, and the planners' controls."""
        records = json.loads(as_json(self._evaluated([], ceilings=METHODS.split(","))))
        for source in METHODS.split(","):
            records += self._stored_errors(source, source)
        records += self._mean_errors()
        found = evaluate_plans(self.plans, [], EvaluateSettings(samples=0), split_file=self.splits)
        return Part([*self._marked([*records, *json.loads(as_json(found))], None, None)])

    def _network(self, system, start, seed):
        run = self.trainer.real(system, start, seed, self.shards, self.splits)
        score = training_score(run)
        if system == "homography":
            return Part([*self._marked(self._homography(last(run)), start, seed)], score)
        runs = {system: last(run)}
        if start in NEED_WORLD and system == "footprints" and seed == 0:
            runs[f"{system}{ZERO_SHOT}"] = last(self.trainer.synthetic(system, start))
        runs |= {
            f"{name}{mark}": self._adapted(one, share)
            for mark, share in SHARES.items()
            for name, one in runs.items()
        }
        return Part([*self._marked(self._scored(runs), start, seed)], score)

    def _adapted(self, run, share):
        """A run adapted to the test images."""
        out = self.trainer.runs / "adapted" / key_of(self.splits.name, run, share)
        if not (out / BEST).exists():
            of_test = ["--split-file", self.splits, "--split", "test"]
            ogmkit("adapt", run, self.shards, "--out", out, "--share", share, *of_test)
        return out

    def _homography(self, run):
        """True footprints warped by the network's homographies, and these one's errors."""
        source = f"network-{key_of(run)}"
        ogmkit("predict", "homography", self.shards, "--checkpoint", run, "--name", source)
        found = json.loads(as_json(self._evaluated([], ceilings=[source])))
        rows = [one | {"system": "homography"} for one in found if one["system"] == ceiling(source)]
        return [*rows, *self._stored_errors(source, "homography")]

    def _planner(self, name, seed):
        run = self.trainer.planner(name, seed)
        settings = EvaluateSettings(samples=0)
        found = evaluate_plans(self.plans, [open_run(run)], settings, split_file=self.splits)
        own = [one for one in json.loads(as_json(found)) if one["system"] == found.systems[0]]
        return Part([*self._marked([one | {"system": name} for one in own], "synthetic", seed)])

    def _scored(self, runs):
        """The rows of runs, by the names that they are given."""
        found = self._evaluated(runs.values(), ceilings=[])
        names = dict(zip(found.systems, runs, strict=True))
        records = json.loads(as_json(found))
        return [one | {"system": names[one["system"]]} for one in records if one["system"] in names]

    def _evaluated(self, runs, ceilings):
        settings = EvaluateSettings(homography=SOURCE, samples=0)
        opened = [open_run(run) for run in runs]
        return evaluate(self.shards, opened, settings, split_file=self.splits, ceilings=ceilings)

    def _stored_errors(self, source, name):
        """Errors of left-out boxes' ground corners, by range, as shards have them."""
        left_out = [one for scene in self.test for one in stored_by(source, self.shards, scene)]
        return self._errors(left_out, name)

    def _mean_errors(self):
        """The same of the training scenes' mean homography."""
        mean = mean_homography(self.shards, self.train)
        frames = [one for scene in self.test for one in measured_by(mean, self.shards, scene)]
        return self._errors(frames, "mean-homography")

    def _errors(self, left_out, name):
        for one in summarise(left_out):
            region = f"{one.from_m:g}-{one.to_m:g} m"
            place = {"definition": PAPER, "target": "vehicles", "view": "bev", "region": region}
            for metric in ("median_m", "p90_m"):
                value = getattr(one, metric)
                values = {"value": value if math.isfinite(value) else None, "low": None, "high": None}
                seen = {"chosen_on_reported": False, "learnt_from_reported": False}
                yield {"system": name, **place, "cells": "all", "metric": f"error_{metric}", **values, **seen}

    def _marked(self, records, start, seed):
        scenes = {"train": ",".join(self.train), "test": ",".join(self.test)}
        return (one | {"start": start, "seed": seed, **scenes} for one in records)

    def _kept(self, name, make):
        """A part as its file has it, made where there is none of this recipe."""
        way = key_of(self.data.resolve(), self.train, self.test, self.trainer.recipe)
        path = self.folder / "results" / way / f"{name}.json"
        if path.is_file():
            return Part(**json.loads(path.read_text()))
        print(f"{','.join(self.train)} → {','.join(self.test)}: {name}", file=sys.stderr, flush=True)
        part = make()
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, asdict(part))
        return part


def best_start(parts):
    """The start whose networks scored best on the training scenes."""

    def mean(start):
        return sum(part.score or 0.0 for part in parts[start]) / len(parts[start])

    return max(parts, key=mean)
