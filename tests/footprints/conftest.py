"""Views over the ground, and an overlap to measure masks with."""

import numpy as np
import pytest

from ogmkit.footprints.view import View
from ogmkit.geometry.se3 import pose_matrix, rotation_matrix

FRONT = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # ego from camera


@pytest.fixture(scope="session")
def make_view():
    """`make_view(height_m, pitch, roll, yaw, image_size, focal_px)`: degrees, nose up is positive."""

    def make(height_m=1.5, pitch=0.0, roll=0.0, yaw=0.0, image_size=(120, 200), focal_px=150.0):
        def turn(degrees, axis):
            half = np.radians(degrees) / 2
            return rotation_matrix([np.cos(half), *(np.sin(half) * np.eye(3)[axis])])

        level_from_camera = pose_matrix([1.7, 0.2, height_m], [1, 0, 0, 0])
        level_from_camera[:3, :3] = turn(yaw, 2) @ turn(-pitch, 1) @ turn(roll, 0) @ FRONT
        height, width = image_size
        intrinsics = [[focal_px, 0, 0.51 * width], [0, focal_px, 0.48 * height], [0, 0, 1]]
        return View(np.array(intrinsics), level_from_camera, image_size)

    return make


@pytest.fixture(scope="session")
def iou():
    """Intersection over union of two masks."""

    def measure(first, second):
        first, second = np.asarray(first) > 0, np.asarray(second) > 0
        return np.count_nonzero(first & second) / np.count_nonzero(first | second)

    return measure
