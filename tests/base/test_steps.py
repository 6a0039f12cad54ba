import numpy as np
import pytest

from ogmkit.base.steps import joined, nearest_rows

MS = 1000


def rows_around_the_first(times_ms, steps, step_s=0.5):
    times_us = MS * np.array(times_ms)
    return nearest_rows(times_us, steps, step_s)[0].tolist()


def test_at_two_hertz_the_kth_neighbour_is_the_kth_frame():
    times_us = 1_500_000_000_000_000 + MS * np.array([0, 449, 1051, 1500, 1950])  # gaps of 0.449 … 0.602 s

    rows = nearest_rows(times_us, range(-2, 3))

    assert rows.tolist() == [
        [-1, -1, 0, 1, 2],
        [-1, 0, 1, 2, 3],
        [0, 1, 2, 3, 4],
        [1, 2, 3, 4, -1],
        [2, 3, 4, -1, -1],
    ]


def test_at_ten_hertz_it_is_every_fifth():
    times_us = 100 * MS * np.arange(40)

    rows = nearest_rows(times_us, range(-6, 7))

    assert rows[30].tolist() == [0, 5, 10, 15, 20, 25, 30, 35, 39, -1, -1, -1, -1]
    assert rows[2].tolist() == [-1] * 6 + [2, 7, 12, 17, 22, 27, 32]
    assert rows[3].tolist() == [-1] * 5 + [
        0,
        3,
        8,
        13,
        18,
        23,
        28,
        33,
    ]  # frame 0: 0.3 s before


def test_at_four_hertz_with_a_step_of_a_fifth_the_nearest_counts():
    # Wanted: 200, 400, 600, 800 ms; 500 is as far from 400, and from 600, as half a step allows.
    assert rows_around_the_first([0, 250, 500, 750], range(1, 5), 0.2) == [1, 2, 2, 3]


def test_the_nearer_of_two_frames_counts():
    assert rows_around_the_first([0, 420, 570, 1000], [1, 2]) == [2, 3]
    assert rows_around_the_first([0, 430, 580, 1000], [1, 2]) == [1, 3]


@pytest.mark.parametrize(
    ("times_ms", "row"), [([0, 250], 1), ([0, 249], -1), ([0, 750], 1), ([0, 751], -1), ([0], -1)]
)
def test_half_a_step_off_is_near_enough_and_more_is_not(times_ms, row):
    assert rows_around_the_first(times_ms, [1]) == [row]


def test_of_two_equally_near_frames_the_outer_one_counts():
    times_us = MS * np.array([0, 500, 1000, 1750, 2250])  # 1500 lies between 1000 + 250 and 1750

    assert nearest_rows(times_us, [2])[1].tolist() == [3]
    assert nearest_rows(times_us[::-1] * -1, [-2])[3].tolist() == [1]


def test_a_frame_in_the_middle_of_two_steps_does_not_lead_on_to_itself():
    times_us = MS * np.array([0, 500, 1250])
    rows = nearest_rows(times_us, [0, 1, 2, 3])[0]

    assert rows.tolist() == [0, 1, 2, 2]
    assert joined(times_us[rows], 0.75).tolist() == [True, True, False]


def test_frames_lead_on_over_the_longest_gap_and_no_further():
    times_us = np.array([[0, 750_000, 1_500_001], [-1, 5, 10], [5, -1, 10]])

    assert joined(times_us, 0.75).tolist() == [[True, False], [False, True], [False, False]]


def test_a_frame_at_time_zero_is_there():
    assert joined(np.array([0, 400_000, 800_000]), 0.5).tolist() == [True, True]
    assert joined(np.array([-1, 0, 1]), 0.5).tolist() == [False, True]


def test_two_frames_of_one_time_do_not_lead_on():
    assert joined(np.array([7, 7, 8]), 1e-6).tolist() == [False, True]


def test_wanted_times_are_rounded_to_the_microsecond():
    # A third of a second: 333 333 µs and 666 667 µs; half a step is 166 666.7 µs.
    times_us = np.array([0, 500_000, 833_333])
    assert nearest_rows(times_us, [1, 2, 3], 1 / 3)[0].tolist() == [-1, 2, -1]
    assert nearest_rows(times_us - [0, 1, 0], [1, 2, 3], 1 / 3)[0].tolist() == [1, 2, -1]
