import math

import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.samples.lidar_image import lidar_image


def slow(points, grid):
    """Point by point, from the grid's edges in metres."""
    image = np.zeros((3, *grid.shape), np.float32)
    highest = np.full(grid.shape, -math.inf)
    (x_near, x_far), (y_right, y_left) = grid.x_range_m, grid.y_range_m
    for x, y, z, intensity in points.astype(float):
        if not (x_near < x < x_far and y_right < y < y_left):
            continue
        row, column = int((x_far - x) / grid.m_per_cell), int((y_left - y) / grid.m_per_cell)
        if z >= highest[row, column]:
            highest[row, column] = z
            distance = math.sqrt(x * x + y * y + z * z)
            image[:, row, column] = distance / 100, (z + 3) / 6, intensity / 255
    return image


def test_a_point_by_hand():
    grid = GridSpec(0.5, 60, 40, 50.0, 15.0)
    points = np.array([[8.2, 6.1, 0.6, 51.0]], np.float32)

    image = lidar_image(points, grid)

    assert np.argwhere(image[2]).tolist() == [[50 - 17, 15 - 13]]
    distance = math.sqrt(8.2**2 + 6.1**2 + 0.6**2)
    assert image[:, 33, 2].tolist() == pytest.approx([distance / 100, 0.6, 0.2])


@pytest.mark.parametrize("seed", range(3))
def test_as_point_by_point(seed):
    rng = np.random.default_rng(seed)
    grid = GridSpec(0.5, 24, 16, 20.0, 5.0)  # reaches behind the ego, and farther right than left
    points = rng.uniform([-6, -10, -3, 0], [14, 6, 3, 255], (3000, 4)).astype(np.float32)
    points[:, 2] = points[:, 2].round()  # many of the same height

    image = lidar_image(points, grid)

    assert image.dtype == np.float32
    np.testing.assert_allclose(image, slow(points, grid), rtol=1e-6)


def test_no_points():
    assert not lidar_image(np.zeros((0, 4), np.float32), GridSpec(1.0, 4, 5, 4.0, 2.0)).any()
