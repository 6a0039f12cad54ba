"""Intervals by resampling scenes: neighbouring frames are too alike to be resampled themselves."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ogmkit.typing import FloatArray, IntArray

DRAWS = 1000
LEVEL = 0.95

_SEED = 0

Sums = TypeVar("Sums", IntArray, FloatArray)
"""Counts, or sums of what was measured, over scenes."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Figures with their intervals, arrays of one shape; NaN where undefined.

    Attributes:
        value: the figures.
        low: lower ends of the intervals; NaN where there is one scene only.
        high: their upper ends, likewise.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray


def estimate(counts: Sums, statistic: Callable[[Sums], FloatArray], draws: int = DRAWS) -> Estimate:
    """A statistic of sums over scenes, with its percentile interval (Efron & Tibshirani, 13.3).

    Scenes are drawn with replacement, as many as there are; draws where the statistic is undefined don't
    count. Equal numbers of scenes get equal draws, so that systems are compared on the same ones. One scene
    gives no interval: all draws would be alike.

    Args:
        counts: (scenes, …), of at least one scene.
        statistic: takes (…) or (draws, …) sums; gives figures, NaN where undefined.
        draws: how many.
    """
    scenes = len(counts)
    if scenes == 1:
        value = statistic(counts[0])
        return Estimate(value, np.full_like(value, np.nan), np.full_like(value, np.nan))
    weights = np.random.default_rng(_SEED).multinomial(scenes, np.full(scenes, 1 / scenes), size=draws)
    drawn = statistic(np.tensordot(weights, counts, axes=1))
    undefined = np.isnan(drawn).all(axis=0)
    tails = ((1 - LEVEL) / 2, (1 + LEVEL) / 2)
    low, high = np.nanquantile(np.where(undefined, 0.0, drawn), tails, axis=0)
    return Estimate(
        statistic(counts.sum(axis=0)), np.where(undefined, np.nan, low), np.where(undefined, np.nan, high)
    )


def interval_notes(scenes: int) -> tuple[str, ...]:
    """What is to be known of intervals found on so many scenes."""
    if scenes > 1:
        return ()
    return ("no confidence intervals: there is one scene only, and they come from resampling scenes",)
