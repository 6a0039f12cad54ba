import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from ogmkit.homography.dlt import direct_linear_transformation, refine
from ogmkit.homography.projective import apply, normalisation, similar

# Image (px) → level frame (m) of a camera 1.5 m over a road that climbs a little.
LEVEL_FROM_IMAGE = np.linalg.inv(
    np.array([[816.0, -1266.0, 40.0], [480.0, -12.0, 1880.0], [1.0, -0.01, -1.6]])
)


def pixels(count, seed=0):
    generator = np.random.default_rng(seed)
    return np.stack([generator.uniform(0, 1600, count), generator.uniform(540, 890, count)], axis=1)


def fitted(source, destination):
    matrix, condition = direct_linear_transformation(source, destination, np.ones((1, len(source))))
    return matrix[0], condition[0]


def unit(matrix):
    return matrix / matrix[2, 2]


@pytest.mark.parametrize("count", [4, 5, 6, 8, 20, 77, 200])
def test_exact_points_come_back_within_a_millionth_of_a_pixel(count):
    source = pixels(count, seed=count)
    destination, _ = apply(LEVEL_FROM_IMAGE, source)
    matrix, condition = fitted(source, destination)
    back, _ = apply(np.linalg.inv(matrix), destination)
    assert np.abs(back - source).max() < 1e-6
    assert condition > 1e-6


@pytest.mark.parametrize("count", [4, 9, 200])
def test_exact_points_give_what_opencv_finds(count):
    source = pixels(count, seed=count)
    destination, _ = apply(LEVEL_FROM_IMAGE, source)
    expected, _ = cv2.findHomography(source, destination, 0)
    found, _ = apply(fitted(source, destination)[0], source)
    # OpenCV rounds its points to float32: seven digits.
    np.testing.assert_allclose(found, apply(expected, source)[0], rtol=5e-7, atol=1e-6)


def test_noisy_points_give_the_svd_of_the_normalised_system():
    generator = np.random.default_rng(5)
    source = pixels(28)
    destination = apply(LEVEL_FROM_IMAGE, source)[0] + generator.normal(0, 0.3, (28, 2))

    def similarity(points):
        mean = points.mean(axis=0)
        scale = np.sqrt(2) / np.linalg.norm(points - mean, axis=1).mean()
        return np.array([[scale, 0, -scale * mean[0]], [0, scale, -scale * mean[1]], [0, 0, 1]])

    to_source, to_destination = similarity(source), similarity(destination)
    rows = []
    for point, other in zip(source, destination, strict=True):
        p = to_source @ [*point, 1]
        x, y, _ = to_destination @ [*other, 1]
        rows += [[0, 0, 0, *-p, *(y * p)], [*p, 0, 0, 0, *(-x * p)]]
    null = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    expected = np.linalg.inv(to_destination) @ null @ to_source
    np.testing.assert_allclose(unit(fitted(source, destination)[0]), unit(expected), rtol=1e-9)


def test_a_weight_of_zero_leaves_a_point_out():
    source = pixels(12)
    destination = apply(LEVEL_FROM_IMAGE, source)[0] + np.random.default_rng(1).normal(0, 0.2, (12, 2))
    weights = np.ones((2, 12))
    weights[0, 3] = weights[1, 7] = 0
    batch, _ = direct_linear_transformation(source, destination, weights)
    for left_out, matrix in zip((3, 7), batch, strict=True):
        rest = np.arange(12) != left_out
        np.testing.assert_allclose(unit(matrix), unit(fitted(source[rest], destination[rest])[0]), rtol=1e-9)


numbers = st.floats(-1000, 1000)
similarities = st.tuples(st.floats(1e-3, 1e3), st.floats(0, 6.28), numbers, numbers)


def similarity_matrix(scale, angle, x, y):
    cosine, sine = scale * np.cos(angle), scale * np.sin(angle)
    return np.array([[cosine, -sine, scale * x], [sine, cosine, scale * y], [0, 0, 1]])


@given(similarities, similarities)
def test_similarities_of_either_plane_do_not_change_the_fit(of_source, of_destination):
    source = pixels(10)
    destination = apply(LEVEL_FROM_IMAGE, source)[0] + np.random.default_rng(2).normal(0, 0.2, (10, 2))
    moved, other = similarity_matrix(*of_source), similarity_matrix(*of_destination)
    matrix, _ = fitted(apply(moved, source)[0], apply(other, destination)[0])
    expected, _ = fitted(source, destination)
    again = np.linalg.inv(other) @ matrix @ moved
    np.testing.assert_allclose(apply(again, source)[0], apply(expected, source)[0], rtol=1e-5, atol=1e-5)


LINE = np.linspace(0, 1, 4)[:, None]


@pytest.mark.parametrize(
    ("source", "destination"),
    [
        ([100, 500] + LINE * [900, 300], [10, 0] + LINE * [30, 9]),
        (np.tile([[800.0, 600.0]], (5, 1)), np.tile([[20.0, 1.0]], (5, 1))),
        ([100, 500] + LINE * [900, 300], [[10.0, 0], [20, 5], [30, 2], [40, 9]]),
        (
            np.r_[[100, 500] + LINE[:3] * [900, 300], [[800, 520]]],
            np.r_[[10, 0] + LINE[:3] * [30, 9], [[9, 9]]],
        ),
        (np.r_[[100, 500] + LINE[:3] * [900, 300], [[800, 520]]], [[10.0, 0], [20, 5], [30, 2], [40, 9]]),
        (np.empty((0, 2)), np.empty((0, 2))),
        (pixels(3), apply(LEVEL_FROM_IMAGE, pixels(3))[0]),
    ],
    ids=[
        "a line",
        "one point",
        "a line in the image only",
        "three of four in a line",
        "the same in the image only",
        "nothing",
        "three",
    ],
)
def test_degenerate_sets_are_badly_conditioned(source, destination):
    assert fitted(np.asarray(source, float), np.asarray(destination, float))[1] < 1e-12


def test_a_far_car_is_not_degenerate():
    corners = np.array([[50.0, 3], [50, 5], [54.5, 5], [54.5, 3]])
    source, _ = apply(np.linalg.inv(LEVEL_FROM_IMAGE), corners)
    assert fitted(source, corners)[1] > 1e-4


@pytest.mark.parametrize(("noise_px", "seed"), [(0.5, 0), (1.0, 1), (3.0, 2)])
def test_the_refined_fit_is_the_maximum_likelihood_estimate(noise_px, seed):
    places, _ = apply(LEVEL_FROM_IMAGE, pixels(24, seed))
    seen = apply(np.linalg.inv(LEVEL_FROM_IMAGE), places)[0]
    seen = seen + np.random.default_rng(seed).normal(0, noise_px, seen.shape)
    weights = np.ones((1, 24))
    linear, _ = direct_linear_transformation(places, seen, weights)

    def rms(matrix):
        return np.sqrt(((apply(matrix, places)[0] - seen) ** 2).sum(axis=1).mean())

    start = np.linalg.inv(LEVEL_FROM_IMAGE)
    scale = start / start[2, 2]
    likeliest = least_squares(
        lambda h: (apply(np.append(h, 1).reshape(3, 3) * scale, places)[0] - seen).ravel(),
        np.ones(8),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    best = np.sqrt(likeliest.fun @ likeliest.fun / 24)
    assert rms(refine(linear, places, seen, weights)[0]) == pytest.approx(best, rel=0.001)
    assert rms(linear[0]) >= best * (1 - 1e-9)


def test_normalised_points_have_mean_zero_and_mean_distance_root_two():
    points = pixels(9)
    weights = np.ones((1, 9))
    weights[0, 4] = 0
    moved = similar(normalisation(points, weights), points)[0][weights[0] > 0]
    np.testing.assert_allclose(moved.mean(axis=0), 0, atol=1e-12)
    assert np.linalg.norm(moved, axis=1).mean() == pytest.approx(np.sqrt(2))
