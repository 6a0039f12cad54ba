import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve

from ogmkit.homography.ground import fit_ground

PLACES = ((9.0, 1.5), (14.0, -4.0), (21.0, 3.5), (28.0, -3.0), (55.0, 20.0))


def hill(points_m):
    return 0.0006 * points_m[..., 0] ** 2 - 0.02 * points_m[..., 1]


def test_without_boxes_the_wheels_hold_the_ground_and_doubt_grows_with_distance(make_frame):
    mean, variance = fit_ground(make_frame([])).height_m(np.array([[0.0, 0], [10, 0], [60, 0]]))
    np.testing.assert_allclose(mean, 0, atol=1e-12)
    assert variance[0] == pytest.approx(1 / (1 / 0.0149 + 1 / 1.1125), rel=1e-9)
    assert variance[0] < variance[1] < variance[2]


def test_posterior_equals_the_textbooks_by_cholesky(make_frame):
    frame = make_frame(PLACES, hill)
    points = np.array([[5.0, -2.0], [33.0, 4.0], [70.0, 30.0]])
    places = np.concatenate([[[0.0, 0.0]], frame.bottoms_level[:, :2]])
    heights = np.concatenate([[0.0], frame.bottoms_level[:, 2]])

    def kernel(p, q):
        d = np.sqrt(5) * np.linalg.norm(p - q) / 60
        return (1 + d + d * d / 3) * np.exp(-d) + (0.05**2 + 0.002**2) * (p @ q) + 0.3**2 + 0.15**2

    ranges = np.linalg.norm(places[1:], axis=1)
    noise = [0.1**2 + 0.07**2, *(0.06**2 + 0.07**2 + (0.05 * ranges / 50) ** 2)]
    covariance = np.array([[kernel(p, q) for q in places] for p in places]) + np.diag(noise)
    factor = cho_factor(covariance)
    mean, variance = fit_ground(frame).height_m(points)
    for point, got_mean, got_variance in zip(points, mean, variance, strict=True):
        cross = np.array([kernel(point, q) for q in places])
        assert got_mean == pytest.approx(cross @ cho_solve(factor, heights), abs=1e-9)
        assert got_variance == pytest.approx(
            kernel(point, point) - cross @ cho_solve(factor, cross), abs=1e-9
        )


def test_a_box_left_out_by_formula_is_a_fit_without_it(make_frame):
    points = np.array([[5.0, -2.0], [28.0, -3.0], [50.0, 10.0]])
    ground = fit_ground(make_frame(PLACES, hill))
    means, variances = ground.height_without_m(points, np.arange(-1, len(PLACES)))
    for left_out in range(-1, len(PLACES)):
        kept = [place for i, place in enumerate(PLACES) if i != left_out]
        mean, variance = fit_ground(make_frame(kept, hill)).height_m(points)
        np.testing.assert_allclose(means[left_out + 1], mean, atol=1e-9)
        np.testing.assert_allclose(variances[left_out + 1], variance, atol=1e-9)


def test_shapes_of_points_are_kept(make_frame):
    mean, variance = fit_ground(make_frame()).height_m(np.zeros((3, 5, 2)))
    assert mean.shape == variance.shape == (3, 5)


@pytest.mark.parametrize("heading_rad", [0.0, 1.8, -3.0])
def test_evidence_lies_before_the_camera_whatever_its_category_or_visibility(make_frame, heading_rad):
    places = [(5, 0), (-1, 0), (79, 0), (81, 0), (10, 24), (10, 26), (40, 49), (40, 51)]
    frame = make_frame(places, heading_rad=heading_rad, category=("human.pedestrian.adult",) * len(places))
    assert fit_ground(frame).box.tolist() == [-1, 0, 2, 4, 6]


def test_a_camera_that_looks_straight_down_still_has_a_ground(make_frame):
    frame = make_frame([])
    down = frame.level_from_camera.copy()
    down[:3, :3] = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
    mean, _ = fit_ground(make_frame([], level_from_camera=down)).height_m(np.array([3.0, 1.0]))
    assert mean == pytest.approx(0.0)
