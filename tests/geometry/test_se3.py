import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyquaternion import Quaternion
from scipy.spatial.transform import Rotation

from ogmkit.geometry.se3 import (
    heading_rad,
    inverse,
    level_from_global,
    pose_matrix,
    rotation_matrix,
    transform_points,
)

_coordinates = st.floats(-1e4, 1e4)
_points = st.tuples(_coordinates, _coordinates, _coordinates)
_quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 1e-3)


@given(_quaternions)
def test_rotations_agree_with_pyquaternion_and_scipy(quaternion):
    matrix = rotation_matrix(quaternion)
    w, x, y, z = quaternion
    np.testing.assert_allclose(matrix, Quaternion(quaternion).normalised.rotation_matrix, atol=1e-12)
    np.testing.assert_allclose(matrix, Rotation.from_quat([x, y, z, w]).as_matrix(), atol=1e-12)


def test_a_quarter_turn_about_z_takes_x_to_y():
    turn = rotation_matrix([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
    np.testing.assert_allclose(turn @ [1, 0, 0], [0, 1, 0], atol=1e-15)


@given(_points, _quaternions, _points)
def test_the_inverse_undoes_a_pose(translation, quaternion, point):
    pose = pose_matrix(translation, quaternion)
    there = transform_points(pose, np.array([point]))
    np.testing.assert_allclose(transform_points(inverse(pose), there), [point], atol=1e-7)
    np.testing.assert_allclose(inverse(pose), np.linalg.inv(pose), atol=1e-7)


def test_stacks_of_poses_move_each_its_own_points():
    rng = np.random.default_rng(0)
    poses = pose_matrix(rng.normal(size=(5, 3)), rng.normal(size=(5, 4)))
    points = rng.normal(size=(5, 7, 3))
    one_by_one = [
        [(pose @ [*point, 1])[:3] for point in own] for pose, own in zip(poses, points, strict=True)
    ]
    np.testing.assert_allclose(transform_points(poses, points), one_by_one, atol=1e-12)
    np.testing.assert_allclose(inverse(poses), [inverse(pose) for pose in poses], atol=1e-12)


@given(_points, st.floats(-3.1, 3.1), st.floats(-1.2, 1.2), st.floats(-1.2, 1.2))
def test_level_keeps_origin_heading_and_up_but_no_roll_or_pitch(origin, heading, pitch, roll):
    x, y, z, w = Rotation.from_euler("ZYX", [heading, pitch, roll]).as_quat()
    global_from_ego = pose_matrix(origin, [w, x, y, z])
    global_from_level = np.linalg.inv(level_from_global(global_from_ego))
    np.testing.assert_allclose(global_from_level[:3, 3], origin, atol=1e-8)
    np.testing.assert_allclose(global_from_level[:3, 2], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(global_from_level[:3, 0], [np.cos(heading), np.sin(heading), 0], atol=1e-9)
    assert heading_rad(global_from_ego) == pytest.approx(heading, abs=1e-9)


def test_level_sees_a_point_ahead_on_the_left_there_although_the_body_pitches():
    half = np.deg2rad(10) / 2
    facing_north = Quaternion(axis=[0, 0, 1], degrees=90) * Quaternion(np.cos(half), 0, np.sin(half), 0)
    global_from_ego = pose_matrix([100, 200, 5], facing_north.elements)
    ahead_left = transform_points(level_from_global(global_from_ego), np.array([[97.0, 210.0, 6.0]]))
    np.testing.assert_allclose(ahead_left, [[10, 3, 1]], atol=1e-9)
