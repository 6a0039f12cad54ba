"""Intervals against exact enumeration."""

from dataclasses import FrozenInstanceError
from itertools import product

import numpy as np
import pytest

from ogmkit.metrics.bootstrap import DRAWS, estimate, interval_notes


def ratio(counts):
    with np.errstate(invalid="ignore"):
        return counts[..., 0] / counts[..., 1]


def test_one_scene_gives_a_value_without_an_interval():
    found = estimate(np.array([[[3, 4], [0, 0]]]), ratio)

    np.testing.assert_array_equal(found.value, [0.75, np.nan])
    np.testing.assert_array_equal([found.low, found.high], np.full((2, 2), np.nan))


def test_two_scenes_by_enumeration():
    # Both drawn: 4/8. One drawn twice: 2/8 or 6/8, each with a chance of 1/4, beyond the tails' 2.5 %.
    found = estimate(np.array([[1, 4], [3, 4]]), ratio)

    assert (found.value, found.low, found.high) == (0.5, 0.25, 0.75)


def test_scenes_are_drawn_with_replacement_and_evenly():
    drawn = []

    def remember(counts):
        drawn.append(counts)
        return counts[..., 0].astype(float)

    estimate(np.array([[1, 0], [0, 1]]), remember)
    first = drawn[0][:, 0]
    assert set(np.unique(drawn[0].sum(axis=1))) == {2}
    np.testing.assert_allclose(np.bincount(first) / len(first), [0.25, 0.5, 0.25], atol=0.05)


def test_five_scenes_against_all_their_draws():
    counts = np.array([[1, 9], [5, 7], [2, 30], [8, 8], [4, 11]])
    every = np.array([ratio(counts[list(draw)].sum(axis=0)) for draw in product(range(5), repeat=5)])
    low, high = np.quantile(every, [0.025, 0.975])
    found = estimate(counts, ratio, draws=20_000)

    assert found.value == 20 / 65
    np.testing.assert_allclose([found.low, found.high], [low, high], atol=0.01)


def test_draws_without_a_value_do_not_count():
    found = estimate(np.array([[0, 0], [1, 4]]), ratio)

    assert (found.value, found.low, found.high) == (0.25, 0.25, 0.25)


def test_what_is_never_defined_stays_so():
    found = estimate(np.array([[[0, 0], [1, 2]], [[0, 0], [1, 2]]]), ratio)

    np.testing.assert_array_equal(found.value, [np.nan, 0.5])
    np.testing.assert_array_equal([found.low, found.high], [[np.nan, 0.5]] * 2)


def test_equal_numbers_of_scenes_get_equal_draws():
    counts = np.array([[1, 9], [5, 7], [2, 30]])
    one, two = estimate(counts, ratio), estimate(2 * counts, ratio)

    assert (one.low, one.high) == (two.low, two.high)


def test_the_interval_is_what_numpy_finds_for_the_draws():
    drawn = []

    def remember(counts):
        drawn.append(ratio(counts))
        return drawn[-1]

    found = estimate(np.array([[1, 9], [5, 7], [2, 30], [8, 8], [4, 11]]), remember)
    draws, value = drawn

    assert len(draws) == DRAWS == 1000
    assert (found.low, found.high) == tuple(np.quantile(draws, [0.025, 0.975]))
    assert found.value == value == 20 / 65


def test_undefined_draws_leave_the_others_their_tails():
    # Of two scenes one has nothing: a quarter of the draws is undefined, the rest are 0 or 1 in one column.
    found = estimate(np.array([[[0, 0], [0, 5]], [[2, 4], [5, 5]]]), ratio)

    np.testing.assert_array_equal(found.low, [0.5, 0])
    np.testing.assert_array_equal(found.high, [0.5, 1])
    np.testing.assert_array_equal(found.value, [0.5, 0.5])


def test_one_scene_alone_is_told():
    (note,) = interval_notes(1)
    assert "one scene only" in note
    assert interval_notes(2) == interval_notes(150) == ()


def test_an_estimate_stays_as_it_is_and_equals_itself_alone():
    one, two = (estimate(np.array([[3, 4]]), ratio) for _ in range(2))
    with pytest.raises(FrozenInstanceError):
        one.value = np.zeros(1)
    assert len({one, two}) == 2  # == of arrays is no truth value
