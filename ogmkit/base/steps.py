"""Key frames a whole number of steps apart: found by time, whatever their rate (design.md §3)."""

from collections.abc import Sequence

import numpy as np

from ogmkit.typing import BoolArray, IntArray

STEPS = 6
"""Key frames of past and of future around a frame."""
STEP_S = 0.5
"""Time from one of them to the next, in seconds, unless settings say otherwise."""
GAP_STEPS = 1.5
"""The longest time between two of them, in steps, unless settings say otherwise."""


def nearest_rows(times_us: IntArray, steps: Sequence[int], step_s: float = STEP_S) -> IntArray:
    """Find the frames that are some steps away from each frame.

    Args:
        times_us: (N,) int64 in temporal order, N ≥ 1.
        steps: K numbers of steps, negative into the past.
        step_s: time from one step to the next.

    Returns:
        (N, K) int64 rows of the frames nearest to each time, of two equally near ones the outer one; −1
        where none is at most half a step from it.
    """
    step_us = step_s * 1e6
    offsets_us = np.round(np.asarray(steps) * step_us).astype(np.int64)
    wanted_us = times_us[:, None] + offsets_us
    last = len(times_us) - 1
    after = np.searchsorted(times_us, wanted_us)
    earlier, later = np.clip([after - 1, after], 0, last)
    before_us, after_us = np.abs([times_us[earlier] - wanted_us, times_us[later] - wanted_us])
    takes_later = np.where(offsets_us > 0, after_us <= before_us, after_us < before_us)
    near = np.minimum(before_us, after_us) <= step_us / 2
    rows: IntArray = np.where(near, np.where(takes_later, later, earlier), -1)
    return rows


def joined(times_us: IntArray, max_gap_s: float) -> BoolArray:
    """(..., K − 1) whether each of (..., K) frames leads on to the next.

    Both are there (a time below 0 stands for none), one is later than the other, and by no more than the gap.
    """
    gaps_us = np.diff(times_us)
    there = (times_us[..., :-1] >= 0) & (times_us[..., 1:] >= 0)
    result: BoolArray = there & (gaps_us > 0) & (gaps_us <= max_gap_s * 1e6)
    return result
