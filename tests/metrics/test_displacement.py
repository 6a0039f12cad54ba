"""Figures worked by hand, in both readings."""

import math

import numpy as np
import pytest

from ogmkit.metrics.displacement import (
    HORIZON_POINTS,
    METRICS,
    OWN_METRICS,
    READINGS,
    horizons_s,
    means_of,
    own_values,
    scene_sums,
)
from ogmkit.metrics.gaussian import ellipse_radius_squared
from ogmkit.metrics.plan import Plan
from ogmkit.metrics.plans import Plans, columns_of, points_only

NAN = math.nan
OFFSETS = np.array([[3.0, 4.0], [0.0, -1.0], [6.0, 8.0], [-5.0, 12.0], [-8.0, 15.0]])
"""Lengths 5, 1, 10, 13 and 17."""


def by_metric(values):
    return dict(zip(OWN_METRICS, values, strict=True))


def read(values, scene=(0, 0), scenes=1):
    """Horizon and reading → figure of one metric's (N, 5) values."""
    found = means_of(scene_sums(np.asarray(values)[None], np.array(scene), scenes).sum(axis=0))[0]
    return {(h, r): found[i, j] for i, h in enumerate((0.5, 1.5, 2.5)) for j, r in enumerate(READINGS)}


def test_horizons_are_the_times_of_their_points():
    assert HORIZON_POINTS == (1, 3, 5)
    assert horizons_s(0.5) == (0.5, 1.5, 2.5)
    assert horizons_s(0.2) == (0.2, 0.6, 1.0)


def test_errors_by_hand():
    truth = np.arange(20.0).reshape(2, 5, 2)
    values = by_metric(own_values(points_only(truth + np.stack([OFFSETS, 0 * OFFSETS])), truth))

    np.testing.assert_array_equal(values["ade"], [[5, 1, 10, 13, 17], [0] * 5])
    np.testing.assert_array_equal(values["l1_longitudinal"], [[3, 0, 6, 5, 8], [0] * 5])
    np.testing.assert_array_equal(values["l1_lateral"], [[4, 1, 8, 12, 15], [0] * 5])
    for metric in ("nll", "inside_50", "inside_90"):
        assert np.isnan(values[metric]).all()


def test_distributions_by_hand():
    # Squared distances 0, 1, 1.44, 4, 4.84 of a standard Gaussian: 50 % lie within 1.386, 90 % within 4.605.
    truth = np.array([[[0, 0], [0, 1], [1.2, 0], [0, -2], [-2.2, 0]]], float)
    plans = columns_of([Plan(np.zeros((5, 2)), np.ones((5, 2)), np.zeros(5))])
    values = by_metric(own_values(plans, truth))

    np.testing.assert_array_equal(values["inside_50"], [[1, 1, 0, 0, 0]])
    np.testing.assert_array_equal(values["inside_90"], [[1, 1, 1, 1, 0]])
    expected = math.log(2 * math.pi) + np.array([[0, 0.5, 0.72, 2, 2.42]])
    np.testing.assert_allclose(values["nll"], expected)


def test_standard_deviations_and_correlation_count():
    # Along the long axis of a Gaussian with σ = (2, 1), ρ = 0.8 the truth is near, across it far.
    truth = np.tile([[2.0, 1.0], [2.0, -1.0]], (3, 1))[None, :5]
    plans = Plans(np.zeros((1, 5, 2)), np.tile([2.0, 1.0], (1, 5, 1)), np.full((1, 5), 0.8))
    values = by_metric(own_values(plans, truth))

    # (1 ∓ 2 · 0.8 + 1) / 0.36 = 1.11 and 10
    np.testing.assert_array_equal(values["inside_50"], [[1, 0, 1, 0, 1]])
    np.testing.assert_array_equal(values["inside_90"], [[1, 0, 1, 0, 1]])


def test_both_readings_of_two_sequences():
    found = read([[5, 1, 10, 13, 17], [1, 3, 2, 3, 1]])

    assert found == {
        (0.5, "at"): 3,
        (0.5, "mean"): 3,
        (1.5, "at"): 6,
        (1.5, "mean"): pytest.approx((16 + 6) / 6),
        (2.5, "at"): 9,
        (2.5, "mean"): pytest.approx((46 + 10) / 10),
    }


def test_what_is_undefined_does_not_count():
    found = read([[NAN, 1, NAN, 0, NAN], [NAN, 0, 1, 1, NAN]])

    assert math.isnan(found[0.5, "at"])
    assert math.isnan(found[0.5, "mean"])
    assert found[1.5, "at"] == 1
    assert found[1.5, "mean"] == pytest.approx(2 / 3)
    assert math.isnan(found[2.5, "at"])
    assert found[2.5, "mean"] == pytest.approx(3 / 5)


def test_sums_go_to_their_scenes():
    sums = scene_sums(np.array([[[1.0] * 5, [2.0] * 5, [4.0] * 5]]), np.array([1, 0, 1]), 2)

    assert sums.shape == (2, 1, 3, 2, 2)
    np.testing.assert_array_equal(sums[:, 0, :, 0], [[[2, 1]] * 3, [[5, 2]] * 3])
    np.testing.assert_array_equal(sums[:, 0, :, 1], [[[2, 1], [6, 3], [10, 5]], [[5, 2], [15, 6], [25, 10]]])


def test_names_are_those_of_the_files():
    assert METRICS == (
        "ade",
        "l1_longitudinal",
        "l1_lateral",
        "nll",
        "inside_50",
        "inside_90",
        "off_drivable",
        "in_vehicle",
    )


def test_horizons_are_told_to_the_microsecond():
    assert horizons_s(0.1234564) == (0.123456, 0.370369, 0.617282)


@pytest.mark.parametrize(("share", "metric"), [(0.5, "inside_50"), (0.9, "inside_90")])
def test_a_point_on_the_ellipse_is_inside_it(share, metric):
    radius = ellipse_radius_squared(share)
    truth = np.zeros((1, 5, 2))
    truth[0, :, 0] = np.sqrt(radius)
    exact = np.sqrt(radius) ** 2 <= radius  # the root is rounded
    truth[0, 1, 0] *= 1 + 1e-9
    truth[0, 2, 0] *= 1 - 1e-9
    values = by_metric(own_values(columns_of([Plan(np.zeros((5, 2)), np.ones((5, 2)), np.zeros(5))]), truth))

    np.testing.assert_array_equal(values[metric], [[exact, 0, 1, exact, exact]])
