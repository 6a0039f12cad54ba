"""Plane maps against OpenCV and by hand."""

import cv2
import numpy as np
import pytest

from ogmkit.homography.projective import apply, determinants, inverse_or_nan, normalisation, similar

MATRIX = np.array([[1.2, 0.3, -4.0], [-0.2, 0.9, 7.0], [0.01, -0.02, 1.1]])


def test_points_are_mapped_as_opencv_maps_them_and_w_is_the_third_coordinate():
    points = np.random.default_rng(0).uniform([-20, 5], [30, 12], (17, 2))
    mapped, w = apply(MATRIX, points)

    np.testing.assert_allclose(mapped, cv2.perspectiveTransform(points[None], MATRIX)[0], rtol=1e-12)
    np.testing.assert_allclose(w, 0.01 * points[:, 0] - 0.02 * points[:, 1] + 1.1)


def test_every_matrix_of_a_batch_maps_its_own_points_and_infinity_is_no_warning():
    matrices = np.stack([MATRIX, np.diag([2.0, 3.0, 0.5]), np.array([[1.0, 0, 0], [0, 1, 0], [1, 0, -2]])])
    points = np.array([[[1.0, 2.0]], [[1.0, 2.0]], [[2.0, 5.0]]])
    mapped, w = apply(matrices, points)

    np.testing.assert_allclose(mapped[0], apply(MATRIX, points[0])[0])
    np.testing.assert_allclose(mapped[1], [[4, 12]])
    assert w[2, 0] == 0
    assert not np.isfinite(mapped[2]).any()


def test_normalised_points_by_hand():
    # Mean (4, 2); distances 5, 5 and 0; the fourth point doesn't count.
    points = np.array([[7.0, 6.0], [1.0, -2.0], [4.0, 2.0], [90.0, 50.0]])
    found = normalisation(points, np.array([1.0, 1.0, 1.0, 0.0]))
    scale = np.sqrt(2) * 3 / 10

    np.testing.assert_allclose(found, [[scale, 0, -4 * scale], [0, scale, -2 * scale], [0, 0, 1]])
    expected = [[3 * scale, 4 * scale], [-3 * scale, -4 * scale], [0, 0], [86 * scale, 48 * scale]]
    np.testing.assert_allclose(similar(found[None], points), [expected], atol=1e-12)


def test_a_point_of_weight_two_counts_twice():
    points = np.array([[7.0, 6.0], [1.0, -2.0], [4.0, 9.0]])
    twice = normalisation(points[[0, 1, 2, 2]], np.ones(4))
    np.testing.assert_allclose(normalisation(points, np.array([1.0, 1.0, 2.0])), twice)


@pytest.mark.parametrize("weights", [[1.0, 1.0], [0.0, 0.0], [3.0, 0.0]])
def test_points_in_one_place_keep_their_scale(weights):
    found = normalisation(np.array([[5.0, -3.0], [5.0, -3.0]]), np.array(weights))
    place = (5, -3) if any(weights) else (0, 0)
    np.testing.assert_allclose(found, [[1, 0, -place[0]], [0, 1, -place[1]], [0, 0, 1]])


def test_the_inverse_of_what_has_none_is_nan():
    infinite, missing = np.eye(3), np.eye(3)
    infinite[0, 1], missing[2, 0] = np.inf, np.nan
    matrices = np.stack([MATRIX, np.diag([1.0, 0.0, 1.0]), infinite, -MATRIX, missing])
    found = inverse_or_nan(matrices)

    np.testing.assert_allclose(found[0], np.linalg.inv(MATRIX))
    np.testing.assert_allclose(found[3], -np.linalg.inv(MATRIX))
    assert np.isnan(found[[1, 2, 4]]).all()
    np.testing.assert_allclose(
        determinants(matrices), [np.linalg.det(MATRIX), 0, 0, -np.linalg.det(MATRIX), 0], atol=1e-15
    )
