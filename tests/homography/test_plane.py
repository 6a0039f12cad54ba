import numpy as np
import pytest
from scipy.optimize import least_squares

from ogmkit.geometry.camera import image_from_ground, project
from ogmkit.geometry.se3 import transform_points
from ogmkit.grid import GridSpec
from ogmkit.homography.methods import fit
from ogmkit.homography.plane import level_from_image
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings


def test_the_plane_of_zeros_is_the_calibration(make_frame):
    frame = make_frame()
    expected = np.linalg.inv(image_from_ground(frame.intrinsics, frame.level_from_camera))
    np.testing.assert_allclose(level_from_image(frame, np.zeros((1, 3)))[0], expected, rtol=1e-9, atol=1e-12)


def test_points_of_a_plane_come_back(make_frame):
    frame = make_frame()
    plane = np.array([0.2, 0.03, -0.02])
    places = np.array([[8.0, 1.0], [25.0, -6.0], [40.0, 9.0]])
    heights = plane[0] + places @ plane[1:]
    pixels, _ = frame.project_level(np.concatenate([places, heights[:, None]], axis=1))
    mapped, w = apply(level_from_image(frame, plane[None])[0], pixels)
    np.testing.assert_allclose(mapped, places, rtol=1e-9)
    assert (w > 0).all()


def test_the_plane_that_the_cars_stand_on_is_found(make_frame):
    # Tilted as the plane is, a car's level bottom face cuts it: flat cars leave only the centres on it.
    frame = make_frame(
        ground=lambda points: 0.2 + 0.03 * points[..., 0] - 0.02 * points[..., 1], size=(0.4, 0.4, 1)
    )
    result = fit("plane", frame, GridSpec(), FitSettings())
    np.testing.assert_allclose(result.plane, [0.2, 0.03, -0.02], atol=2e-3)


def test_the_fit_is_the_minimum_that_scipy_finds(make_frame):
    rough = make_frame(ground=lambda points: 0.15 * np.sin(points[..., 0] * 3 + points[..., 1]))
    corners = rough.ground_corners_level.reshape(-1, 3)
    pixels = rough.ground_corners_px.reshape(-1, 2)

    def distances_px(plane):
        moved = corners.copy()
        moved[:, 2] = plane[0] + moved[:, :2] @ plane[1:]
        seen, _ = project(rough.intrinsics, transform_points(rough.camera_from_level, moved))
        return np.linalg.norm(seen - pixels, axis=1)

    expected = least_squares(distances_px, np.zeros(3), loss="soft_l1", x_scale=[0.1, 0.01, 0.01], xtol=1e-14)
    result = fit("plane", rough, GridSpec(), FitSettings())
    np.testing.assert_allclose(result.plane, expected.x, rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("method", ["plane", "calibration", "ego-plane"])
def test_methods_with_a_plane_tell_it(make_frame, method):
    np.testing.assert_allclose(fit(method, make_frame(), GridSpec(), FitSettings()).plane, 0, atol=1e-9)
