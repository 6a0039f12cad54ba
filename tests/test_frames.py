import numpy as np

from ogmkit.frames import neighbours


def test_a_frame_s_neighbours_end_with_the_drive():
    times_us = np.array([500_010, 1_000_020, 1_500_030])
    positions = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]])

    around_us, around = neighbours(times_us, positions)

    assert around_us.tolist() == [
        [-1] * 6 + [500_010, 1_000_020, 1_500_030] + [-1] * 4,
        [-1] * 5 + [500_010, 1_000_020, 1_500_030] + [-1] * 5,
        [-1] * 4 + [500_010, 1_000_020, 1_500_030] + [-1] * 6,
    ]
    assert around.shape == (3, 13, 3)
    for i in range(3):
        assert around[i, 6 - i : 9 - i].tolist() == positions.tolist()
        assert np.isnan(np.delete(around[i], range(6 - i, 9 - i), axis=0)).all()


def test_a_long_drive_has_neighbours_on_both_sides():
    around_us, _ = neighbours(500_000 * np.arange(20), np.zeros((20, 3)))

    assert around_us[9].tolist() == list(range(1_500_000, 8_000_000, 500_000))


def test_a_frame_that_is_missing_leaves_its_step_empty():
    times_us = np.delete(500_000 * np.arange(20), [11])
    positions = np.arange(57.0).reshape(19, 3)

    around_us, around = neighbours(times_us, positions)

    assert around_us[9].tolist() == [1_500_000 + 500_000 * k if k != 8 else -1 for k in range(13)]
    assert np.isnan(around[9, 8]).all()
    assert around[9, 9].tolist() == positions[11].tolist()


def test_at_another_rate_and_step_neighbours_are_found_by_time():
    times_us = 100_000 * np.arange(40)
    positions = np.stack([np.arange(40.0), np.zeros(40), np.zeros(40)], axis=1)

    _, around = neighbours(times_us, positions)
    assert around[30, :8, 0].tolist() == [0, 5, 10, 15, 20, 25, 30, 35]
    _, around = neighbours(times_us, positions, 0.2)
    assert around[20, :, 0].tolist() == list(range(8, 34, 2))
