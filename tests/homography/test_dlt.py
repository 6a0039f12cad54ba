import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from ogmkit.homography.dlt import degeneracies, design_matrix, direct_linear_transformation, estimate, refine
from ogmkit.homography.projective import apply, normalisation, similar
from ogmkit.homography.settings import FitSettings

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


def test_the_system_of_two_points_by_hand():
    source, destination = np.array([[[2.0, 3.0], [5.0, -1.0]]]), np.array([[[7.0, -4.0], [0.5, 6.0]]])
    system = design_matrix(source, destination, np.array([[1.0, 4.0]]))

    assert system.shape == (1, 9, 9)
    by_hand = [
        [0, 0, 0, -2, -3, -1, -8, -12, -4],
        [2, 3, 1, 0, 0, 0, -14, -21, -7],
        [0, 0, 0, -10, 2, -2, 60, -12, 12],
        [10, -2, 2, 0, 0, 0, -5, 1, -1],
    ]
    np.testing.assert_allclose(system[0, :4], by_hand)
    assert not system[0, 4:].any()


@pytest.mark.parametrize(("count", "rows"), [(4, 9), (5, 10), (6, 12)])
def test_the_system_has_two_rows_a_point_and_nine_at_least(count, rows):
    points = pixels(count)[None]
    assert design_matrix(points, points, np.ones((1, count))).shape == (1, rows, 9)


def test_a_weight_of_two_counts_a_point_twice():
    source = pixels(9)
    destination = apply(LEVEL_FROM_IMAGE, source)[0] + np.random.default_rng(3).normal(0, 0.2, (9, 2))
    weights = np.ones((1, 9))
    weights[0, 4] = 2
    twice = [*range(9), 4]
    found, condition = direct_linear_transformation(source, destination, weights)
    expected, condition_twice = fitted(source[twice], destination[twice])

    np.testing.assert_allclose(unit(found[0]), unit(expected), rtol=1e-9)
    assert condition[0] == pytest.approx(condition_twice)


def test_conditioning_is_of_the_system_or_of_the_solution():
    source = pixels(7)
    destination = apply(LEVEL_FROM_IMAGE, source)[0]
    weights = np.ones((1, 7))
    to_source, to_destination = normalisation(source, weights), normalisation(destination, weights)
    system = design_matrix(similar(to_source, source), similar(to_destination, destination), weights)
    values = np.linalg.svd(system[0], compute_uv=False)
    solution = to_destination[0] @ LEVEL_FROM_IMAGE @ np.linalg.inv(to_source[0])
    least = min(values[7] / values[0], 1 / np.linalg.cond(solution))

    assert fitted(source, destination)[1] == pytest.approx(least, rel=1e-6)


@pytest.mark.parametrize("turn_px", [0.5, 4.0])
def test_the_robust_fit_has_the_least_soft_l1_loss(turn_px):
    generator = np.random.default_rng(11)
    places, _ = apply(LEVEL_FROM_IMAGE, pixels(24))
    start = np.linalg.inv(LEVEL_FROM_IMAGE)
    seen = apply(start, places)[0] + generator.normal(0, 1.0, (24, 2))
    seen[:4] += generator.normal(0, 30.0, (4, 2))

    def roots(h):
        """Of the loss, point by point."""
        squares = ((apply(h.reshape(3, 3), places)[0] - seen) ** 2).sum(axis=1)
        return np.sqrt(2 * turn_px**2 * (np.sqrt(1 + squares / turn_px**2) - 1))

    linear, _ = direct_linear_transformation(places, seen, np.ones((1, 24)))
    robust = refine(linear, places, seen, np.ones((1, 24)), soft_l1=np.array([turn_px]))[0]
    scale = (robust / robust[2, 2]).ravel()
    best = least_squares(
        lambda h: roots(np.append(h, 1) * scale), np.ones(8), xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    assert (roots(robust) ** 2).sum() == pytest.approx(2 * best.cost, rel=2e-5)
    assert (roots(linear[0]) ** 2).sum() > 1.2 * 2 * best.cost


def test_refining_leaves_out_what_has_no_weight():
    places, _ = apply(LEVEL_FROM_IMAGE, pixels(12))
    seen = apply(np.linalg.inv(LEVEL_FROM_IMAGE), places)[0]
    seen = seen + np.random.default_rng(2).normal(0, 1.0, seen.shape)
    weights = np.ones((1, 12))
    weights[0, 5], rest = 0, np.arange(12) != 5
    start = np.linalg.inv(LEVEL_FROM_IMAGE)[None]
    found = refine(start, places, seen, weights)[0]
    expected = refine(start, places[rest], seen[rest], np.ones((1, 11)))[0]
    np.testing.assert_allclose(unit(found), unit(expected), rtol=1e-6)


def test_badly_conditioned_systems_are_refused_and_earlier_reasons_stay():
    found = degeneracies(["", "too few", "", ""], np.array([1.1e-9, 0.0, 0.9e-9, 1e-9]))
    assert found[:2] == ["", "too few"]
    assert "degenerate" in found[2]
    assert found[3] == ""


def test_one_car_is_enough_unless_more_is_asked_for(make_frame):
    frame = make_frame([(14.0, 2.0)])
    found = estimate(frame, np.array([-1, 0]), FitSettings())
    assert found.valid.tolist() == [True, False]
    assert found.points_used.tolist() == [4, 0]
    assert "fewer than 4" in found.reasons[1]
    landed, _ = apply(found.level_from_image[0], frame.ground_corners_px[0])
    np.testing.assert_allclose(landed, frame.ground_corners_level[0, :, :2], atol=1e-6)
    refused = estimate(frame, np.array([-1]), FitSettings(min_points=5))
    assert "4 usable corners, fewer than 5" in refused.reasons[0]
