"""Plans that cost nothing: a planner that is no better has learnt nothing."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from ogmkit.base.steps import STEPS as DESTINATION
from ogmkit.metrics.plan import STEPS
from ogmkit.typing import FloatArray

_T = np.arange(1.0, STEPS + 1)
"""The points' times in steps."""
_KNOTS = (-2.0, -1.0, 0.0, float(DESTINATION))
"""Times that the cubic goes through."""


def constant_velocity(past: FloatArray, destination: FloatArray) -> FloatArray:
    """The last displacement, repeated.

    Args:
        past: (N, 6, 2) positions at steps −6 … −1, metres, level frame; at 0 the ego is at (0, 0).
        destination: (N, 2) position at step 6; doesn't matter here.

    Returns:
        (N, 5, 2) positions at steps 1 … 5.
    """
    del destination
    return driving_on(past, STEPS)


def driving_on(past: FloatArray, points: int) -> FloatArray:
    """(N, points, 2) positions where the last displacement of a (N, 6, 2) past is repeated."""
    return -past[:, -1:] * np.arange(1.0, points + 1)[:, None]


def straight_line(past: FloatArray, destination: FloatArray) -> FloatArray:
    """Equal steps to the destination; arguments as of `constant_velocity`, whose past doesn't matter here."""
    del past
    line: FloatArray = destination[:, None] * (_T / DESTINATION)[:, None]
    return line


def cubic(past: FloatArray, destination: FloatArray) -> FloatArray:
    """The cubic polynomial in time through steps −2, −1, 0 and the destination's, 6, by Lagrange.

    Arguments as of `constant_velocity`.
    """
    through = np.stack([past[:, -2], past[:, -1], np.zeros_like(destination), destination], axis=1)
    found: FloatArray = _CUBIC @ through
    return found


def _lagrange(times: FloatArray, knots: tuple[float, ...]) -> FloatArray:
    """(T, K) weights of K knots at (T,) times."""
    weights = np.ones((len(times), len(knots)))
    for column, own in enumerate(knots):
        for other in knots[:column] + knots[column + 1 :]:
            weights[:, column] *= (times - other) / (own - other)
    return weights


_CUBIC = _lagrange(_T, _KNOTS)

CONSTANT_VELOCITY = "constant-velocity"
CONTROLS: Mapping[str, Callable[[FloatArray, FloatArray], FloatArray]] = MappingProxyType(
    {CONSTANT_VELOCITY: constant_velocity, "straight-line": straight_line, "cubic": cubic}
)
"""By the names that tables have for them."""
