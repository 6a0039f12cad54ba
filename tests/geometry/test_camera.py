import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ogmkit.geometry.camera import image_from_ground, image_from_resized, project
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


@pytest.mark.parametrize(("size", "copy"), [((90, 160), (45, 32)), ((37, 50), (111, 20)), ((8, 8), (8, 8))])
def test_corners_of_an_image_and_its_resized_copy_coincide(size, copy):
    # By hand: from centres to corners, stretched, and back.
    stretch = np.diag([size[1] / copy[1], size[0] / copy[0], 1])
    to_corner, to_centre = (np.array([[1, 0, half], [0, 1, half], [0, 0, 1]]) for half in (0.5, -0.5))
    np.testing.assert_allclose(image_from_resized(size, copy), to_centre @ stretch @ to_corner, atol=1e-12)
    corners = np.array([[-0.5, copy[1] - 0.5], [-0.5, copy[0] - 0.5], [1, 1]])
    expected = [[-0.5, size[1] - 0.5], [-0.5, size[0] - 0.5], [1, 1]]
    np.testing.assert_allclose(image_from_resized(size, copy) @ corners, expected)


def test_resized_pixels_are_where_opencv_takes_them_from():
    size, copy = (60, 150), (20, 30)
    v, u = np.mgrid[: size[0], : size[1]].astype(np.float64)
    taken = [cv2.resize(ramp, copy[::-1], interpolation=cv2.INTER_LINEAR) for ramp in (u, v)]
    rows, columns = np.mgrid[: copy[0], : copy[1]]
    places = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ image_from_resized(size, copy).T
    np.testing.assert_allclose(places[..., :2], np.stack(taken, axis=-1), atol=1e-4)


def test_the_ground_homography_of_an_upright_camera_by_hand():
    # 1.5 m up at (1.7, 0.1), looking along x: depth is x − 1.7, u falls to the right, v to the ground.
    homography = image_from_ground(_INTRINSICS, _upright())
    u, v, w = homography @ [11.7, 3.1, 1]
    assert w == pytest.approx(10)
    assert (u / w, v / w) == pytest.approx((816.3 - 1266.4 * 3 / 10, 491.5 + 1260.1 * 1.5 / 10))


def _upright():
    pose = np.eye(4)
    pose[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    pose[:3, 3] = [1.7, 0.1, 1.5]
    return pose
