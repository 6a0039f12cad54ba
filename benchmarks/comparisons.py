"""Differences of two rows on the same scenes, with intervals by scene, from what parts have told."""

import numpy as np

from ogmkit.metrics.bootstrap import DRAWS, LEVEL, Estimate, estimate
from ogmkit.metrics.iou import iou

FOREGROUND = 0
_SEED = 0


def iou_difference(one, other):
    """Foreground IoU of one row less another's.

    Args:
        one: (scenes, outcome) counts.
        other: the same, of the same scenes.
    """

    def away(sums):
        found = iou(sums)[..., FOREGROUND]
        return found[..., 0] - found[..., 1]

    return estimate(np.stack([one, other], axis=1), away)


def mean_difference(one, other, *, over_seeds=False):
    """Mean of one row less another's, over sequences and seeds, with its interval by scene.

    Args:
        one: (seeds, scenes, 2) sums, and numbers of sequences.
        other: the same; of one seed where it learns nothing.
        over_seeds: whether seeds are drawn too.
    """
    away = np.stack([one[..., 0] - other[..., 0], one[..., 1]], axis=-1)
    seeds = len(away)
    weights = np.full(seeds, 1 / seeds)
    if over_seeds:
        drawn = np.random.default_rng(_SEED + 1).multinomial(seeds, weights, size=DRAWS) / seeds

    def mean(sums):
        with np.errstate(invalid="ignore"):  # a draw of scenes without any is left out
            by_seed = sums[..., 0] / sums[..., 1]
        return (by_seed * (drawn if over_seeds and by_seed.ndim > 1 else weights)).sum(axis=-1)

    return estimate(np.swapaxes(away, 0, 1), mean)


def median_ratio(one, other):
    """Median of one homography's errors over another's, with its interval by scene; NaN of zeros.

    Args:
        one: a list of arrays in metres, scene by scene; infinite where an error has no bound.
        other: the same, of the same scenes.
    """
    value = _ratio(one, other, range(len(one)))
    random = np.random.default_rng(_SEED)
    drawn = [_ratio(one, other, random.integers(len(one), size=len(one))) for _ in range(DRAWS)]
    low, high = (
        np.nanquantile(drawn, ((1 - LEVEL) / 2, (1 + LEVEL) / 2)) if np.isfinite(value) else [value] * 2
    )
    return Estimate(np.asarray(value), np.asarray(low), np.asarray(high))


def _ratio(one, other, scenes):
    above, below = (np.median(np.concatenate([each[i] for i in scenes])) for each in (one, other))
    return above / below if below > 0 else np.nan


def in_range(errors, from_m, to_m):
    """Errors in metres of the boxes in a range, scene by scene."""
    found = []
    for scene in errors:
        range_m = np.array(scene["range_m"])
        error_m = np.array([np.inf if one is None else one for one in scene["error_m"]])
        found.append(error_m[(range_m >= from_m) & (range_m < to_m)])
    return found


def told(found, form, scale=1.0):
    """`12.3 [10.1–15.0]`; without the interval where there is none, NA where there is no figure."""
    value, low, high = (format(scale * float(one), form) for one in (found.value, found.low, found.high))
    if np.isnan(found.value):
        return "NA"
    between = ", " if form.startswith("+") else "–"
    return (value if np.isnan(found.low) else f"{value} [{low}{between}{high}]").replace("-", "−")
