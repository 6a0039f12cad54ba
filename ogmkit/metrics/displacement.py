"""The figures of plans: of each point, then over all sequences, read in two ways.

The paper's formula of the ADE averages over the points up to a horizon, its table can be read as the
displacement at it: both are given, `mean` and `at` (design.md §3).
"""

import numpy as np

from ogmkit.metrics.gaussian import (
    ellipse_radius_squared,
    mahalanobis_squared,
    negative_log_likelihood,
)
from ogmkit.metrics.plans import Plans
from ogmkit.typing import FloatArray, IntArray

OWN_METRICS = ("ade", "l1_longitudinal", "l1_lateral", "nll", "inside_50", "inside_90")
"""What follows from plan and truth alone."""
SURROUNDING_METRICS = ("off_drivable", "in_vehicle")
"""What depends on what is around the points."""
METRICS = OWN_METRICS + SURROUNDING_METRICS

HORIZON_POINTS = (1, 3, 5)
"""The points that lie at the horizons, counted from 1."""
READINGS = ("at", "mean")
"""At the horizon's point; over the points up to it."""


def horizons_s(step_s: float) -> tuple[float, ...]:
    """The horizons in seconds: 0.5, 1.5 and 2.5 where points are half a second apart."""
    return tuple(round(step_s * point, 6) for point in HORIZON_POINTS)


def own_values(plans: Plans, truth: FloatArray) -> FloatArray:
    """Errors of plans against the truth, point by point.

    Args:
        plans: of N sequences.
        truth: (N, 5, 2) true positions, metres.

    Returns:
        (6, N, 5) in the order of `OWN_METRICS`: metres, nats, 0 or 1; NaN where there is no distribution.
    """
    offset = truth - plans.mean
    distance = mahalanobis_squared(offset, plans.sigma, plans.rho)
    return np.stack(
        [
            np.hypot(*np.moveaxis(offset, -1, 0)),
            *np.moveaxis(np.abs(offset), -1, 0),
            negative_log_likelihood(offset, plans.sigma, plans.rho),
            *(_at_most(distance, ellipse_radius_squared(share)) for share in (0.5, 0.9)),
        ]
    )


def scene_sums(values: FloatArray, scene: IntArray, scenes: int) -> FloatArray:
    """Add up by scene what each horizon and reading is made of.

    Args:
        values: (M, N, 5) of M metrics; NaN doesn't count.
        scene: (N,) number of each sequence's scene.
        scenes: how many there are.

    Returns:
        (scenes, M, 3, 2, 2): by horizon and reading, the sum of values and how many there are.
    """
    defined = ~np.isnan(values)
    parts = np.stack([np.where(defined, values, 0.0), defined], axis=-1)
    points = np.array(HORIZON_POINTS) - 1
    readings = np.stack([parts[:, :, points], parts.cumsum(axis=2)[:, :, points]], axis=3)
    sums = np.zeros((scenes, len(values), len(HORIZON_POINTS), len(READINGS), 2))
    np.add.at(sums, scene, np.swapaxes(readings, 0, 1))
    return sums


def means_of(sums: FloatArray) -> FloatArray:
    """(..., 2) sums and numbers → (...) means; NaN where nothing was defined."""
    with np.errstate(invalid="ignore"):
        return np.asarray(sums[..., 0] / sums[..., 1])


def _at_most(distance: FloatArray, radius: float) -> FloatArray:
    return np.where(np.isnan(distance), np.nan, distance <= radius)
