"""Rows of the planners' table that need no run: what was driven, and controls."""

from collections.abc import Mapping

from ogmkit.base.names import with_number
from ogmkit.evaluation.planning.sequences import Sequences
from ogmkit.metrics.controls import CONSTANT_VELOCITY, CONTROLS, driving_on
from ogmkit.metrics.linear import EGO_STATUS, LINEAR, fit_linear_plan
from ogmkit.metrics.open_loop.horizons import POINTS
from ogmkit.metrics.plans import Plans, points_only
from ogmkit.samples.splits import TRAIN
from ogmkit.typing import FloatArray

TRUTH = "truth"
"""The row of what was driven: without errors, but not always on drivable cells."""
FIXED = (TRUTH, *CONTROLS, LINEAR)
"""All rows, in order; without training sequences there is no `linear`."""


def fixed_plans(sequences: Sequences, training: Sequences | None) -> Mapping[str, Plans]:
    """Row → its plans for some sequences.

    Args:
        sequences: that are evaluated.
        training: what the linear control is fitted to; None leaves it out.
    """
    controls = dict(CONTROLS)
    if training is not None:
        controls[LINEAR] = fit_linear_plan(training.past, training.destination, training.truth)
    plans = {name: control(sequences.past, sequences.destination) for name, control in controls.items()}
    return {name: points_only(points) for name, points in {TRUTH: sequences.truth, **plans}.items()}


def untold_points(sequences: Sequences, training: Sequences | None) -> Mapping[str, FloatArray]:
    """Row → its (N, 6, 2) positions, of rows that aren't told the destination, the truth first.

    Args:
        sequences: that are evaluated.
        training: what `ego-status` is fitted to; None leaves it out.
    """
    rows = {TRUTH: sequences.future, CONSTANT_VELOCITY: driving_on(sequences.past, POINTS)}
    if training is not None:
        rows[EGO_STATUS] = fit_linear_plan(training.past, None, training.future)(sequences.past, None)
    return rows


def linear_note(training: Sequences | None) -> str:
    """What the linear control was fitted to, or why there is none."""
    if training is None:
        return (
            f"no {LINEAR}: split {TRAIN!r} has no sequence to fit it to, other than those of scenes "
            "that are evaluated"
        )
    found = f"{with_number(len(training), 'sequence')} in {with_number(training.scenes, 'scene')}"
    return f"{LINEAR}: fitted to {found} of split {TRAIN!r}"
