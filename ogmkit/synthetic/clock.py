"""When sensors fire: LiDAR sweeps at 20 Hz, cameras at 12 Hz, key frames about every half second."""

from dataclasses import dataclass

import numpy as np

from ogmkit.typing import IntArray

_SWEEP_US = 50_000
_SWEEPS_PER_KEY_FRAME = 10
_IMAGE_US = 83_333
_SLIP_SHARE = 0.08  # of key frames that come one sweep early or late, as in nuScenes
_JITTER_US = 600
# A key frame's images are taken before its LiDAR sweep ends; the real delays.
CAMERA_DELAYS_US = {
    "CAM_FRONT": -35_200,
    "CAM_FRONT_RIGHT": -27_100,
    "CAM_BACK_RIGHT": -19_500,
    "CAM_BACK": -10_000,
    "CAM_BACK_LEFT": -400,
    "CAM_FRONT_LEFT": -42_800,
}


@dataclass(frozen=True, eq=False)
class Shot:
    """One firing of a sensor.

    Attributes:
        timestamp_us: when.
        sample: index of the key frame that it belongs to: its own, or the next one.
        is_key: whether it is the key frame's.
    """

    timestamp_us: int
    sample: int
    is_key: bool


def key_times(random: np.random.Generator, start_us: int, frames: int) -> IntArray:
    """(frames,) timestamps of the samples, which are their LiDAR's; gaps of 0.4 to 0.6 s."""
    slips = np.cumsum(np.full(frames, _SWEEPS_PER_KEY_FRAME))
    late = random.uniform(size=frames) < _SLIP_SHARE
    early = ~late & (random.uniform(size=frames) < _SLIP_SHARE)
    slips = slips + late - early
    jitter = random.integers(-_JITTER_US, _JITTER_US + 1, frames)
    times: IntArray = start_us + (slips - slips[0]) * _SWEEP_US + jitter
    return times


def shots(random: np.random.Generator, samples_us: IntArray, channel: str, *, sweeps: bool) -> list[Shot]:
    """All firings of one sensor over a scene, in order.

    Args:
        random: source of the jitter.
        samples_us: (N,) timestamps of the key frames.
        channel: a camera's, or the LiDAR's.
        sweeps: also what lies between key frames.
    """
    delay_us = CAMERA_DELAYS_US.get(channel, 0)
    period_us = _IMAGE_US if channel in CAMERA_DELAYS_US else _SWEEP_US
    jitter_us = (
        random.integers(-500, 501, len(samples_us)) if delay_us else np.zeros(len(samples_us), np.int64)
    )
    keys_us = samples_us + delay_us + jitter_us
    fired: list[Shot] = []
    for sample, time_us in enumerate(keys_us):
        if sweeps and sample:
            gap_us = time_us - keys_us[sample - 1]
            count = round(gap_us / period_us)
            between = keys_us[sample - 1] + gap_us * np.arange(1, count) // count
            fired += [Shot(int(between_us), sample, is_key=False) for between_us in between]
        fired.append(Shot(int(time_us), sample, is_key=True))
    return fired
