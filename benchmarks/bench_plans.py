"""Parts that score planners: errors by scene and kind of sequence, so that rows can be compared."""

import numpy as np
from bench_data import data_of, train
from planning_gain import regression_errors

from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.planning.fixed import TRUTH, fixed_plans
from ogmkit.evaluation.planning.sequences import sequences_of, training_sequences
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.learn.predict.run import open_run
from ogmkit.metrics.controls import cubic

SPEED_M, SIDE_M = 0.7, 0.5
"""How far a cubic must stray along or across for speed or course to count as changing."""
AT, UP_TO = "at", "mean"
TOLD = [
    *(("ade", AT, horizon_s) for horizon_s in (0.5, 1.5, 2.5)),
    *((metric, UP_TO, 2.5) for metric in ("ade", "l1_longitudinal", "l1_lateral", "nll", "in_vehicle")),
]
"""Figures of a row: metric, reading and horizon."""


def make_planner(bench, part):
    """Train a planner and score it on the sequences to report."""
    perception = part.settings.get("perception")
    more = ["--perception", bench.at(perception) / "run"] if perception else []
    run = train(bench, part, *more)
    shards, splits = data_of(bench, part)
    sequences = _reported(shards, splits)
    settings = EvaluateSettings(samples=len(sequences))
    found = evaluate_plans(shards, [open_run(run)], settings, split_file=splits)
    (name,) = found.systems
    mean = np.stack([sample.plan.mean for sample in found.samples])
    return _told(sequences, {name: mean}) | {"figures": {name: _figures(found, name)}}


def make_controls(bench, part):
    """Plans that need no network."""
    shards, splits = data_of(bench, part)
    sequences = _reported(shards, splits)
    training = training_sequences(shards, sequences, limit=None)
    plans = {name: one.mean for name, one in fixed_plans(sequences, training).items() if name != TRUTH}
    found = evaluate_plans(shards, [], EvaluateSettings(samples=0), split_file=splits)
    return _told(sequences, plans) | {"figures": {name: _figures(found, name) for name in plans}}


def make_gain(bench, part):
    """A regression from past and destination, and one that is told of vehicles exactly, seed by seed."""
    shards, splits = data_of(bench, part)
    sequences = _reported(shards, splits)
    training = training_sequences(shards, sequences, limit=None)
    errors = regression_errors(
        training.index, sequences.index, part.settings["seeds"], part.settings["epochs"]
    )
    return _told(sequences, {name: sequences.truth + one for name, one in errors.items()})


def kinds_of(sequences):
    """{kind: (N,) which sequences are of it}, by how far a cubic strays from what was driven."""
    strays = np.abs(cubic(sequences.past, sequences.destination) - sequences.truth).max(axis=1)
    speed, course = strays[:, 0] > SPEED_M, strays[:, 1] > SIDE_M
    return {
        "all": np.ones(len(sequences), dtype=bool),
        "speed changes": speed,
        "course changes": course,
        "neither": ~speed & ~course,
    }


def ade_sums(sequences, plans):
    """{kind: (scenes, 2)}: sums of the mean distance up to 2.5 s in metres, and numbers of sequences.

    Args:
        sequences: that were planned.
        plans: (N, 5, 2) positions in metres.
    """
    distances = np.linalg.norm(plans - sequences.truth, axis=-1).mean(axis=1)
    sums = {}
    for kind, chosen in kinds_of(sequences).items():
        sums[kind] = np.zeros((sequences.scenes, 2))
        both = np.column_stack([distances, np.ones(len(distances))])
        np.add.at(sums[kind], sequences.scene[chosen], both[chosen])
    return sums


def _reported(shards, splits):
    return sequences_of(shards, split=None, split_file=splits, cameras=(), limit=None)


def _told(sequences, plans):
    sums = {name: ade_sums(sequences, one) for name, one in plans.items()}
    return {
        "scenes": sequences.scene_names,
        "sequences": len(sequences),
        "ade_sums": {
            name: {kind: one.round(6).tolist() for kind, one in of.items()} for name, of in sums.items()
        },
    }


def _figures(found, name):
    """`ade at 0.5` → value and interval."""
    of = {(one.metric, one.reading, one.horizon_s): one for one in found.figures if one.system == name}
    return {
        f"{metric} {reading} {horizon_s}": _known(of[metric, reading, horizon_s])
        for metric, reading, horizon_s in TOLD
    }


def _known(figure):
    values = (figure.value, figure.low, figure.high)
    return [None if np.isnan(value) else round(value, 5) for value in values]
