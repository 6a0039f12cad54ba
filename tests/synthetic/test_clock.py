from itertools import pairwise

import numpy as np

from ogmkit.synthetic.clock import CAMERA_DELAYS_US, key_times, shots


def test_key_frames_are_about_half_a_second_apart():
    times = key_times(np.random.default_rng(0), 1_000_000, 400)
    gaps = np.diff(times)
    assert abs(times[0] - 1_000_000) < 1000
    assert 0.45e6 < np.median(gaps) < 0.55e6
    assert gaps.min() > 0.38e6
    assert gaps.max() < 0.62e6
    assert len(np.unique(gaps)) > 100


def test_cameras_fire_before_the_sample_and_the_lidar_with_it():
    random = np.random.default_rng(0)
    samples = key_times(random, 0, 30)
    for channel, delay_us in CAMERA_DELAYS_US.items():
        fired = np.array([shot.timestamp_us for shot in shots(random, samples, channel, sweeps=False)])
        assert np.abs(fired - samples - delay_us).max() <= 500
    lidar = [shot.timestamp_us for shot in shots(random, samples, "LIDAR_TOP", sweeps=False)]
    assert lidar == samples.tolist()


def test_sweeps_lie_evenly_between_key_frames_and_belong_to_the_next_one():
    random = np.random.default_rng(0)
    samples = key_times(random, 0, 5)
    for channel, period_us in (("CAM_FRONT", 83_333), ("LIDAR_TOP", 50_000)):
        fired = shots(random, samples, channel, sweeps=True)
        times = np.array([shot.timestamp_us for shot in fired])
        assert np.abs(np.diff(times) - period_us).max() < 20_000
        assert [shot.sample for shot in fired if shot.is_key] == [0, 1, 2, 3, 4]
        for shot, following in pairwise(fired):
            assert following.sample == shot.sample + shot.is_key
