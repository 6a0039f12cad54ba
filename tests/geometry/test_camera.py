import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ogmkit.geometry.camera import image_from_ground, project
from ogmkit.geometry.se3 import inverse, transform_points

_INTRINSICS = np.array([[1266.4, 0.0, 816.3], [0.0, 1260.1, 491.5], [0.0, 0.0, 1.0]])


def _level_from_camera(height_m=1.5, heading=0.0, pitch=0.0):
    pose = np.eye(4)
    ahead = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    pose[:3, :3] = Rotation.from_euler("ZYX", [heading, pitch, 0.02]).as_matrix() @ ahead
    pose[:3, 3] = [1.7, 0.1, height_m]
    return pose


def test_projection_agrees_with_opencv():
    points = np.random.default_rng(0).uniform([-20, -5, 1], [20, 5, 80], (50, 3))
    pixels, depth = project(_INTRINSICS, points)
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), _INTRINSICS, None)
    np.testing.assert_allclose(pixels, expected[:, 0], rtol=1e-9)
    np.testing.assert_array_equal(depth, points[:, 2])


def test_a_point_on_the_axis_falls_on_the_principal_point_and_right_is_right():
    pixels, _ = project(_INTRINSICS, np.array([[0.0, 0.0, 7.0], [1.0, 0.0, 7.0], [0.0, 1.0, 7.0]]))
    np.testing.assert_allclose(pixels[0], [816.3, 491.5])
    assert pixels[1, 0] > pixels[0, 0]
    assert pixels[2, 1] > pixels[0, 1]


def test_depth_zero_gives_no_warning_and_no_finite_pixel():
    pixels, depth = project(_INTRINSICS, np.array([[1.0, 1.0, 0.0]]))
    assert depth[0] == 0
    assert not np.isfinite(pixels).any()


@given(st.floats(-3, 3), st.floats(-0.3, 0.3), st.floats(-50, 50), st.floats(-50, 50))
def test_the_ground_homography_agrees_with_projecting_the_point(heading, pitch, x, y):
    level_from_camera = _level_from_camera(heading=heading, pitch=pitch)
    u, v, w = image_from_ground(_INTRINSICS, level_from_camera) @ [x, y, 1]
    camera = transform_points(inverse(level_from_camera), np.array([[x, y, 0.0]]))
    pixels, depth = project(_INTRINSICS, camera)
    np.testing.assert_allclose(w, depth[0], atol=1e-9)
    np.testing.assert_allclose([u, v], pixels[0] * depth[0], rtol=1e-9, atol=1e-6)
