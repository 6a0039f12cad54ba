"""Which planner is better where: differences of ADE on the same sequences, for `benchmarks/planning.py`."""

from itertools import groupby

import numpy as np

from ogmkit.metrics.bootstrap import estimate
from ogmkit.metrics.controls import cubic

PAIRS = (
    ("mid-to-end", "lstm-ed"),
    ("mid-to-end-short", "lstm-ed-short"),
    ("holistic", "lstm-ed-short"),
    ("holistic", "holistic-cv"),
    ("holistic", "end-to-end"),
    ("mid-to-end", "mid-to-end-np"),
    ("holistic", "holistic-np"),
    ("end-to-end", "end-to-end-np"),
)
SPEED_M, SIDE_M = 0.7, 0.5
"""How far a cubic must stray along or across for speed or course to count as changing."""


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


def distances_of(sequences, samples):
    """{system: (N,) mean distance to the truth up to 2.5 s, over its seeds}, metres."""
    found = {}
    for run, plans in groupby(samples, key=lambda sample: sample.system):
        errors = np.stack([sample.plan.mean for sample in plans]) - sequences.truth
        system = run.rstrip("0123456789").rstrip("-")
        found.setdefault(system, []).append(np.linalg.norm(errors, axis=-1).mean(axis=1))
    return {system: np.mean(values, axis=0) for system, values in found.items()}


def difference(values, chosen, scene, scenes):
    """Mean of the chosen values with its interval, as text."""
    sums = np.zeros((scenes, 2))
    np.add.at(sums, scene[chosen], np.column_stack([values[chosen], np.ones(np.count_nonzero(chosen))]))
    with np.errstate(invalid="ignore"):  # a draw of scenes without any is left out
        found = estimate(sums, lambda drawn: drawn[..., 0] / drawn[..., 1])
    return f"{found.value:+.3f} [{found.low:+.3f}, {found.high:+.3f}]"


def pairs_table(sequences, samples):
    """ADE of each system, mean over its seeds, and differences with intervals by scene, in markdown.

    `samples` are plans of all the sequences, run by run; of names that end in a seed, the seeds are averaged.
    """
    kinds, distances = kinds_of(sequences), distances_of(sequences, samples)
    header = [f"{kind} ({np.count_nonzero(chosen)})" for kind, chosen in kinds.items()]
    rows = [["", *header], ["---", *["---:"] * len(kinds)]]
    for system, values in distances.items():
        rows.append([system, *(f"{values[chosen].mean():.3f}" for chosen in kinds.values())])
    for one, other in PAIRS:
        away = distances[one] - distances[other]
        texts = (difference(away, chosen, sequences.scene, sequences.scenes) for chosen in kinds.values())
        rows.append([f"{one} − {other}", *texts])
    title = "ADE in metres, mean up to 2.5 s, and differences with their 95 % intervals by scene:"
    return "\n".join([title, "", *(f"| {' | '.join(row)} |" for row in rows)])
