"""Past and future positions of the ego around a frame, in that frame's level coordinates (design.md §3)."""

from dataclasses import dataclass

import numpy as np

from ogmkit.base.steps import GAP_STEPS, STEP_S, STEPS, joined
from ogmkit.frames import AROUND, FrameRecord
from ogmkit.geometry.se3 import transform_points
from ogmkit.typing import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Positions about a step apart, oldest first; NaN where one is missing.

    Attributes:
        past: (6, 2) float64, x forward and y left in metres, steps −6 … −1.
        past_valid: (6,) bool.
        future: (6, 2) float64, steps +1 … +6.
        future_valid: (6,) bool.
        valid: whether all twelve are there.
    """

    past: FloatArray
    past_valid: BoolArray
    future: FloatArray
    future_valid: BoolArray
    valid: bool


def trajectory(
    frame: FrameRecord, max_gap_s: float = GAP_STEPS * STEP_S, *, step_s: float = STEP_S
) -> Trajectory:
    """The ego's path through the key frames at six steps before and six after a frame.

    Args:
        frame: the frame.
        max_gap_s: a longer time between two neighbours ends the path there, as does one that is missing:
            nothing beyond counts.
        step_s: time from one step to the next; a neighbour over half a step from its time is missing.
    """
    wanted_us = frame.timestamp_us + np.round(np.array(AROUND) * step_s * 1e6)
    found_us = frame.neighbour_timestamps_us
    times_us = np.where(np.abs(found_us - wanted_us) <= step_s * 1e6 / 2, found_us, -1)
    leads_on = joined(times_us, max_gap_s)
    past_valid = np.logical_and.accumulate(leads_on[STEPS - 1 :: -1])[::-1]
    future_valid = np.logical_and.accumulate(leads_on[STEPS:])
    xy = transform_points(frame.level_from_global, frame.neighbour_positions_global)[:, :2]
    return Trajectory(
        past=np.where(past_valid[:, None], xy[:STEPS], np.nan),
        past_valid=past_valid,
        future=np.where(future_valid[:, None], xy[STEPS + 1 :], np.nan),
        future_valid=future_valid,
        valid=bool(past_valid.all() and future_valid.all()),
    )
