"""From values at six points to figures at 1, 2 and 3 s, by each definition's reading."""

import numpy as np

from ogmkit.metrics.open_loop.definition import Missing, Reading
from ogmkit.typing import FloatArray

POINTS = 6
"""Points of a plan that these scores are taken at."""
HORIZON_POINTS = (2, 4, 6)
"""The points that lie at the horizons, counted from 1."""


def horizons_s(step_s: float) -> tuple[float, ...]:
    """The horizons in seconds: 1, 2 and 3 where points are half a second apart."""
    return tuple(round(step_s * point, 6) for point in HORIZON_POINTS)


def l2_m(points: FloatArray, truth: FloatArray, missing: Missing) -> FloatArray:
    """Distances of plans to the truth.

    Args:
        points: (..., 6, 2) metres; NaN where a plan has none.
        truth: (..., 6, 2) metres; NaN where there is none.
        missing: what a step without truth is.

    Returns:
        (..., 6) metres; NaN where nothing counts.
    """
    distances: FloatArray = np.linalg.norm(points - truth, axis=-1)
    if missing == "left-out":
        return distances
    return np.where(np.isnan(truth).any(axis=-1) & ~np.isnan(points).any(axis=-1), 0.0, distances)


def at_horizons(values: FloatArray, reading: Reading) -> FloatArray:
    """Read values of points at the horizons.

    Args:
        values: (..., 6); NaN where not defined.
        reading: how.

    Returns:
        (..., 3); NaN where a value that it needs is not defined, so that no horizon is passed off by a
        nearer one.
    """
    last = np.array(HORIZON_POINTS) - 1
    if reading == "at":
        return values[..., last]
    if reading == "mean":
        return np.asarray(values.cumsum(axis=-1)[..., last] / HORIZON_POINTS)
    highest: FloatArray = np.maximum.accumulate(values, axis=-1)
    return highest[..., last]
