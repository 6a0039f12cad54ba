"""Runs of consecutive integers, without a loop over them."""

import numpy as np

from ogmkit.typing import IntArray


def ranges(first: IntArray, counts: IntArray) -> IntArray:
    """Concatenate first[i], first[i] + 1, … of counts[i] integers each.

    Args:
        first: (N,) where each run begins.
        counts: (N,) lengths, 0 or more.

    Returns:
        (sum of counts,).
    """
    stops = np.cumsum(counts)
    result: IntArray = np.arange(counts.sum()) + np.repeat(first - (stops - counts), counts)
    return result
