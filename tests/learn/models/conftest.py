"""Cameras over the ground, and what every network has to stand."""

import numpy as np
import pytest

from ogmkit.geometry.camera import image_from_ground
from ogmkit.geometry.se3 import pose_matrix, rotation_matrix

FRONT = np.array(
    [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
)  # level from a camera that looks ahead


@pytest.fixture(autouse=True)
def _seed():
    import torch  # here: this file is read where torch is absent, too

    torch.manual_seed(3)


@pytest.fixture(scope="session")
def make_camera():
    """`make_camera(image_size, …)`: intrinsics and level_from_camera; degrees, nose down is positive."""

    def make(image_size, *, focal_px=None, height_m=1.5, pitch=0.0, roll=0.0, yaw=0.0):
        def turn(degrees, axis):
            half = np.radians(degrees) / 2
            return rotation_matrix([np.cos(half), *(np.sin(half) * np.eye(3)[axis])])

        height, width = image_size
        focal_px = 0.8 * width if focal_px is None else focal_px
        intrinsics = np.array([[focal_px, 0, 0.51 * width], [0, focal_px, 0.48 * height], [0, 0, 1]])
        level_from_camera = pose_matrix([1.7, 0.2, height_m], [1, 0, 0, 0])
        level_from_camera[:3, :3] = turn(yaw, 2) @ turn(pitch, 1) @ turn(roll, 0) @ FRONT
        return intrinsics, level_from_camera

    return make


@pytest.fixture(scope="session")
def make_homography(make_camera):
    """`make_homography(grid, image_size, …)`: bev_from_image by calibration, |h33| = 1."""

    def make(grid, image_size, **pose):
        matrix = grid.bev_from_level @ np.linalg.inv(image_from_ground(*make_camera(image_size, **pose)))
        return matrix / abs(matrix[2, 2])

    return make


@pytest.fixture(scope="session")
def check_network():
    """`check_network(make, inputs)`: gradients reach all, eval repeats itself, weights restore.

    Returns what the network gives for the inputs in eval mode.
    """
    import torch

    def first(result):
        return result[0] if isinstance(result, tuple) else result

    def check(make, inputs):
        net = make().train()
        outputs = first(net(*inputs))
        (outputs * torch.randn_like(outputs)).sum().backward()
        unreached = [name for name, p in net.named_parameters() if p.grad is None or not p.grad.any()]
        assert not unreached
        net.eval()
        torch.manual_seed(99)
        other = make().eval()
        with torch.no_grad():
            result = first(net(*inputs))
            assert torch.equal(first(net(*inputs)), result)
            assert not torch.equal(first(other(*inputs)), result)
            other.load_state_dict(net.state_dict())
            assert torch.equal(first(other(*inputs)), result)
        assert torch.isfinite(result).all()
        return result

    return check
