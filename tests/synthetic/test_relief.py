import numpy as np
import pytest

from ogmkit.geometry.se3 import heading_rad, pose_matrix, transform_points
from ogmkit.synthetic.curves import Path
from ogmkit.synthetic.motion import Driving
from ogmkit.synthetic.relief import ego_pose, rolling_ground


def drive(start_m_s=8.0, end_m_s=8.0):
    times = np.arange(0.0, 10.0, 0.1)
    speeds = np.interp(times, [0, 10], [start_m_s, end_m_s])
    path = Path(np.array([[0.0, 0.0], [60.0, 30.0], [120.0, 60.0]]))
    return Driving(path, times, 3.4 + np.cumsum(speeds) * 0.1, speeds, 3.4, 2.59, 0.0)


def test_flat_ground_keeps_the_body_level_however_it_brakes():
    translation, rotation = ego_pose(drive(10, 0), 5.0, None)
    assert translation[2] == 0.0
    assert rotation[1:3] == [0.0, 0.0]


def test_rear_axle_stands_on_the_ground_and_the_body_follows_the_slope():
    def height(xy):
        return 0.05 * xy[..., 0]

    translation, rotation = ego_pose(drive(), 5.0, height)
    matrix = pose_matrix(translation, rotation)
    assert translation[2] == pytest.approx(0.05 * translation[0])
    assert heading_rad(matrix) == pytest.approx(np.arctan2(1, 2), abs=2e-3)
    wheels = transform_points(matrix, np.array([[0, 0.7, 0], [0, -0.7, 0], [2.59, 0.7, 0], [2.59, -0.7, 0]]))
    assert wheels[:, 2] == pytest.approx(0.05 * wheels[:, 0], abs=2e-3)


def test_braking_lowers_the_nose():
    def height(xy):
        return 0.0 * xy[..., 0]

    matrix = pose_matrix(*ego_pose(drive(12, 2), 5.0, height))
    assert matrix[2, 0] == pytest.approx(-0.007, rel=0.05)


def test_ground_varies_by_the_relief_and_smoothly():
    height = rolling_ground(np.random.default_rng(2), 4.0)
    grid = np.stack(np.meshgrid(np.arange(0, 400, 2.0), np.arange(0, 400, 2.0)), axis=-1)
    z = height(grid)
    assert 2.0 < z.max() - z.min() < 8.0
    assert np.abs(np.diff(z, axis=0)).max() / 2 < 0.15
    assert z[50:100, 50:100].max() - z[50:100, 50:100].min() > 0.5


def test_a_leaning_body_has_its_nose_down_and_leans_left_and_sways():
    tilt_rad = np.radians(1.2)
    matrices = [pose_matrix(*ego_pose(drive(), time_s, None, tilt_rad)) for time_s in np.arange(0, 9, 0.5)]
    level = [pose_matrix(*ego_pose(drive(), time_s, None)) for time_s in np.arange(0, 9, 0.5)]
    np.testing.assert_allclose([heading_rad(one) for one in matrices], [heading_rad(one) for one in level])
    forward_falls = np.degrees([-one[2, 0] for one in matrices])
    left_falls = np.degrees([-one[2, 1] for one in matrices])
    assert (forward_falls.min(), forward_falls.max()) == pytest.approx((0.9, 1.5), abs=0.02)
    assert (left_falls.min(), left_falls.max()) == pytest.approx((0.72, 1.2), abs=0.02)
