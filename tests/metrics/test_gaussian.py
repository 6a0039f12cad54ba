"""Gaussians against scipy's."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2, multivariate_normal

from ogmkit.metrics.gaussian import (
    ellipse,
    ellipse_radius_squared,
    mahalanobis_squared,
    negative_log_likelihood,
)

OFFSETS = st.floats(-50, 50)
SIGMAS = st.floats(0.05, 20)
RHOS = st.floats(-0.98, 0.98)


def covariance(sigma, rho):
    x, y = sigma
    return np.array([[x * x, rho * x * y], [rho * x * y, y * y]])


@given(st.tuples(OFFSETS, OFFSETS), st.tuples(SIGMAS, SIGMAS), RHOS)
def test_the_likelihood_is_scipys(offset, sigma, rho):
    found = negative_log_likelihood(np.array(offset), np.array(sigma), np.array(rho))

    expected = -multivariate_normal(np.zeros(2), covariance(sigma, rho)).logpdf(offset)
    assert found == pytest.approx(expected, rel=1e-7, abs=1e-9)


def test_distances_are_those_of_the_covariance_for_arrays_of_any_shape():
    generator = np.random.default_rng(0)
    offset, sigma = generator.normal(size=(3, 4, 2)), generator.uniform(0.1, 3, (3, 4, 2))
    rho = generator.uniform(-0.9, 0.9, (3, 4))
    found = mahalanobis_squared(offset, sigma, rho)

    assert found.shape == (3, 4)
    for place in np.ndindex(3, 4):
        precision = np.linalg.inv(covariance(sigma[place], rho[place]))
        assert found[place] == pytest.approx(offset[place] @ precision @ offset[place])


def test_a_standard_gaussian_by_hand():
    offset, sigma, rho = np.array([3.0, 4.0]), np.ones(2), np.array(0.0)

    assert mahalanobis_squared(offset, sigma, rho) == 25
    assert negative_log_likelihood(offset, sigma, rho) == pytest.approx(math.log(2 * math.pi) + 12.5)


def test_almost_full_correlation_stays_finite():
    offset, sigma, rho = np.array([1e4, -1e4]), np.full(2, 0.05), np.array(1 - 1e-12)

    assert np.isfinite(negative_log_likelihood(offset, sigma, rho))


@pytest.mark.parametrize("share", [0.5, 0.9, 0.99])
def test_ellipses_hold_their_share(share):
    assert ellipse_radius_squared(share) == pytest.approx(chi2.ppf(share, 2))

    mean, sigma, rho = np.array([3.0, -1.0]), np.array([2.0, 0.5]), 0.7
    outline = ellipse(mean, sigma, rho, share)
    distances = mahalanobis_squared(outline - mean, sigma, np.array(rho))
    np.testing.assert_allclose(distances, chi2.ppf(share, 2))
    # By the shoelace formula: π r² σx σy √(1 − ρ²), but for the corners of a polygon of 72 sides.
    area = (
        abs(np.sum(outline[:, 0] * np.roll(outline[:, 1], 1) - outline[:, 1] * np.roll(outline[:, 0], 1))) / 2
    )
    assert area == pytest.approx(math.pi * chi2.ppf(share, 2) * math.sqrt(1 - 0.49), rel=2e-3)


@pytest.mark.parametrize("points", [None, 5])
def test_an_outline_goes_round_evenly_by_cholesky_s_factor(points):
    mean, sigma, rho, share = np.array([3.0, -1.0]), np.array([2.0, 0.5]), -0.6, 0.8
    outline = ellipse(mean, sigma, rho, share) if points is None else ellipse(mean, sigma, rho, share, points)

    count = points or 72
    angle = 2 * math.pi * np.arange(count) / count
    factor = np.linalg.cholesky(covariance(sigma, rho))
    circle = np.stack([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(outline, mean + math.sqrt(chi2.ppf(share, 2)) * (factor @ circle).T, atol=1e-9)
