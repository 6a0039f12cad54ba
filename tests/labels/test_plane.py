"""Frames told apart by tilt: which pose, which part of its rotation."""

from dataclasses import replace

import numpy as np
import pytest
from pyquaternion import Quaternion

from ogmkit.errors import TableError
from ogmkit.frames import KeyFrame
from ogmkit.geometry.se3 import heading_rad, inverse, pose_matrix
from ogmkit.labels.plane import intrinsic_yaw_rad, plane_of
from ogmkit.nuscenes.records import no_boxes

TILT = Quaternion(axis=(0.3, -0.8, 0.1), degrees=3.0)
POSE = Quaternion(axis=(0, 0, 1), degrees=130.0) * TILT
MOUNT = Quaternion(axis=(0, 0, 1), degrees=-90.0) * Quaternion(axis=(1, 0, 0), degrees=1.0)
T = np.array([512.3, 1788.1, 1.5])
POINTS = T + np.array([[20.0, -3.0, 0.4], [-7.5, 31.0, -1.0]])


@pytest.fixture
def key_frame(tmp_path):
    return KeyFrame(
        dataroot=tmp_path,
        location="nowhere",
        sample_token="a",
        global_from_ego=pose_matrix(T, POSE.elements),
        ego_from_lidar=pose_matrix([0.9, 0.0, 1.8], MOUNT.elements),
        lidar_path="none.bin",
        boxes=no_boxes(),
    )


def test_the_yaw_is_pyquaternions_and_not_the_heading(key_frame):
    pose = key_frame.global_from_ego
    assert intrinsic_yaw_rad(pose) == pytest.approx(POSE.yaw_pitch_roll[0], abs=1e-14)
    assert abs(intrinsic_yaw_rad(pose) - float(heading_rad(pose))) > 1e-4


def test_the_whole_rotation(key_frame):
    expected = [POSE.inverse.rotate(point - T)[:2] for point in POINTS]
    np.testing.assert_allclose(plane_of("lidar-ego", key_frame).local(POINTS), expected, atol=1e-12)


def test_the_yaw_alone(key_frame):
    turn = Quaternion(axis=(0, 0, 1), radians=-POSE.yaw_pitch_roll[0])
    expected = [turn.rotate(point - T)[:2] for point in POINTS]
    np.testing.assert_allclose(plane_of("lidar-ego-yaw", key_frame).local(POINTS), expected, atol=1e-12)


def test_in_float32_the_origin_is_off_by_the_rounding_of_map_coordinates(key_frame):
    exact = plane_of("lidar-ego-yaw", key_frame).local(POINTS)
    off = np.abs(plane_of("lidar-ego-yaw-float32", key_frame).local(POINTS) - exact).max()
    assert 1e-7 < off < 1e-3


def test_the_lidars_heading(key_frame):
    pose = key_frame.global_from_ego @ key_frame.ego_from_lidar
    plane = plane_of("lidar-heading", key_frame)
    assert plane.turn_rad == pytest.approx(np.arctan2(pose[1, 0], pose[0, 0]), abs=1e-6)
    ahead = plane.local(pose[:3, 3] + 10 * pose[:3, 0])  # along the LiDAR's x, the car's right
    np.testing.assert_allclose(ahead, [10 * np.hypot(*pose[:2, 0]), 0], atol=1e-3)


def test_the_cameras_axes_as_they_lie_on_the_map(key_frame, key_frames, fixture_root):
    front = next(iter(key_frames(fixture_root).values())).camera
    tilted = replace(front, global_from_ego=key_frame.global_from_ego)
    plane = plane_of("camera", replace(key_frame, camera=tilted))
    pose = tilted.global_from_ego @ tilted.ego_from_camera
    right, ahead = pose[:3, 0], pose[:3, 2]
    point = pose[:3, 3] + 4 * right + 9 * ahead
    np.testing.assert_allclose(plane.local(point[None]), [[4, 9]], atol=1e-9)
    np.testing.assert_allclose(plane.local_2d(point[None, :2]), [[4, 9]], atol=1e-9)


def test_the_level_frame_of_the_image(key_frame, key_frames, fixture_root):
    frame = next(iter(key_frames(fixture_root).values()))
    points = frame.camera.global_from_ego[:3, 3] + POINTS - T
    in_level = inverse(inverse(frame.camera.level_from_global)) @ np.column_stack([points, [1, 1]]).T
    np.testing.assert_allclose(plane_of("image-level", frame).local(points), in_level[:2].T, atol=1e-9)


@pytest.mark.parametrize("frame", ["camera", "image-level"])
def test_a_cameras_frame_needs_a_camera(key_frame, frame):
    with pytest.raises(TableError, match="has no frame of the front camera; leave it out"):
        plane_of(frame, key_frame)
