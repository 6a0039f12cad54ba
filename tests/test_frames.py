import numpy as np

from ogmkit.frames import neighbours


def test_a_frame_s_neighbours_end_with_the_drive():
    times_us = np.array([10, 20, 30])
    positions = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, 9]])

    around_us, around = neighbours(times_us, positions)

    assert around_us.tolist() == [
        [-1] * 6 + [10, 20, 30] + [-1] * 4,
        [-1] * 5 + [10, 20, 30] + [-1] * 5,
        [-1] * 4 + [10, 20, 30] + [-1] * 6,
    ]
    assert around.shape == (3, 13, 3)
    for i in range(3):
        assert around[i, 6 - i : 9 - i].tolist() == positions.tolist()
        assert np.isnan(np.delete(around[i], range(6 - i, 9 - i), axis=0)).all()


def test_a_long_drive_has_neighbours_on_both_sides():
    around_us, _ = neighbours(np.arange(20), np.zeros((20, 3)))

    assert around_us[9].tolist() == list(range(3, 16))
