"""The linear plan against linear motions, and against other ways to the same least squares."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.metrics.linear import fit_linear_plan

MIRROR = np.array([1.0, -1.0])
SEEDS = st.integers(0, 2**32 - 1)


def sequences(count, seed=0, places=6):
    """Past, destination and points without any relation."""
    rng = np.random.default_rng(seed)
    past, destination = rng.normal(0, 20, (count, places, 2)), rng.normal(30, 9, (count, 2))
    return past, destination, rng.normal(9, 5, (count, 5, 2))


def affine(past, destination, seed):
    """Points of a map that is drawn at random."""
    rng = np.random.default_rng(seed)
    features = np.concatenate([past.reshape(len(past), -1), destination], axis=1)
    found = features @ rng.normal(size=(features.shape[1], 10)) + rng.normal(0, 9, 10)
    return found.reshape(-1, 5, 2)


@given(SEEDS)
def test_an_affine_map_is_found_by_as_many_sequences_as_it_has_unknowns(seed):
    past, destination, _ = sequences(15, seed)
    plan = fit_linear_plan(past, destination, affine(past, destination, seed))

    past, destination, _ = sequences(40, seed + 1)
    np.testing.assert_allclose(plan(past, destination), affine(past, destination, seed), atol=1e-4)


def test_least_squares_are_those_of_the_normal_equations():
    past, destination, points = sequences(60)
    ones = np.column_stack([past.reshape(60, -1), destination, np.ones(60)])
    solution = np.linalg.solve(ones.T @ ones, ones.T @ points.reshape(60, -1))

    found = fit_linear_plan(past, destination, points)(past, destination)
    np.testing.assert_allclose(found, (ones @ solution).reshape(-1, 5, 2), atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 9])
def test_fewer_sequences_than_unknowns_get_the_smallest_weights_that_are_exact(count):
    past, destination, points = sequences(count)
    plan = fit_linear_plan(past, destination, points)

    np.testing.assert_allclose(plan(past, destination), points, atol=1e-9)
    features = np.concatenate([past.reshape(count, -1), destination], axis=1)
    features, targets = (values - values.mean(axis=0) for values in (features, points.reshape(count, -1)))
    np.testing.assert_allclose(plan.weights, np.linalg.pinv(features) @ targets, atol=1e-9)


def test_what_is_like_the_mean_of_all_gets_the_mean_of_all_plans():
    past, destination, points = sequences(7)
    plan = fit_linear_plan(past, destination, points)

    found = plan(past.mean(axis=0)[None], destination.mean(axis=0)[None])
    np.testing.assert_allclose(found, points.mean(axis=0)[None], atol=1e-9)


def test_noise_of_float32_is_not_learnt_from():
    past, destination, points = sequences(50)
    past[:, 1] = past[:, 0] / 3
    rounded = past.astype(np.float32).astype(np.float64)
    plan, other = (fit_linear_plan(each, destination, points) for each in (past, rounded))

    np.testing.assert_allclose(other.weights, plan.weights, atol=1e-5)
    past[:, 1] += 1.0  # no sequence was like this
    assert np.abs(other(past, destination) - points).max() < 100


@given(SEEDS)
def test_in_a_mirrored_world_plans_are_mirrored(seed):
    past, destination, points = sequences(20, seed, places=2)
    plan = fit_linear_plan(past, destination, points)
    mirrored = fit_linear_plan(past * MIRROR, destination * MIRROR, points * MIRROR)

    found = mirrored(past * MIRROR, destination * MIRROR)
    np.testing.assert_allclose(found, plan(past, destination) * MIRROR, atol=1e-6)
