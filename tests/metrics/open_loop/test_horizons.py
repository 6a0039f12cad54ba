"""Distances and readings, worked by hand."""

import numpy as np
import pytest

from ogmkit.metrics.open_loop.horizons import at_horizons, horizons_s, l2_m

TRUTH = np.column_stack([np.arange(1.0, 7.0) * 5, np.zeros(6)])
"""10 m/s straight on."""
OFF = np.array([[0.3, 0.4], [0.6, 0.8], [0.9, 1.2], [1.2, 1.6], [1.5, 2.0], [1.8, 2.4]])
"""0.5, 1, 1.5, 2, 2.5 and 3 m away."""


def test_both_readings_of_the_same_plan():
    found = l2_m(TRUTH + OFF, TRUTH, "left-out")

    np.testing.assert_allclose(found, [0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
    np.testing.assert_allclose(at_horizons(found, "at"), [1.0, 2.0, 3.0])
    np.testing.assert_allclose(at_horizons(found, "mean"), [0.75, 1.25, 1.75])


def test_a_missing_step_is_an_error_of_nothing_or_does_not_count():
    truth = TRUTH.copy()
    truth[4:] = np.nan
    plan = TRUTH + OFF

    zero, none = (l2_m(plan, truth, missing) for missing in ("zero-error", "left-out"))
    np.testing.assert_allclose(zero, [0.5, 1.0, 1.5, 2.0, 0.0, 0.0])
    np.testing.assert_allclose(at_horizons(zero, "at"), [1.0, 2.0, 0.0])
    np.testing.assert_allclose(at_horizons(none, "at"), [1.0, 2.0, np.nan])
    np.testing.assert_allclose(at_horizons(none, "mean"), [0.75, 1.25, np.nan])


@pytest.mark.parametrize("missing", ["zero-error", "left-out"])
@pytest.mark.parametrize("reading", ["at", "mean", "up-to"])
def test_a_plan_without_a_point_at_3_s_has_no_figure_there(missing, reading):
    plan = TRUTH + OFF
    plan[5] = np.nan

    found = at_horizons(l2_m(plan, TRUTH, missing), reading)
    assert np.isnan(found).tolist() == [False, False, True]


def test_up_to_a_horizon_is_whether_it_holds_of_any_point():
    values = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 1]], float)

    np.testing.assert_array_equal(at_horizons(values, "up-to"), [[0, 1, 1], [0, 0, 0], [1, 1, 1]])
    np.testing.assert_allclose(at_horizons(values, "mean")[0], [0, 1 / 4, 1 / 6])


def test_horizons_are_as_many_steps():
    assert horizons_s(0.5) == (1.0, 2.0, 3.0)
    assert horizons_s(0.4) == (0.8, 1.6, 2.4)
