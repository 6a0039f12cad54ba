import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.homography.methods import fit
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings

PLACES = ((9.0, 1.5), (14.0, -4.0), (21.0, 3.5), (26.0, -5.0), (30.0, 8.0), (36.0, 6.0), (42.0, -7.0))


def error_m(method, frame):
    grid = GridSpec()
    matrix = fit(method, frame, grid, FitSettings()).bev_from_image
    landed = grid.positions_m(apply(matrix, frame.ground_corners_px[:3].reshape(-1, 2))[0])
    return np.linalg.norm(landed - frame.ground_corners_level[:3, :, :2].reshape(-1, 2), axis=1).max()


@pytest.mark.parametrize("method", ["robust", "plane"])
def test_a_floating_box_hardly_moves_the_fit(make_frame, method):
    frame = make_frame(PLACES, ground=lambda points: 0.8 * (np.abs(points[..., 0] - 30.0) < 0.1))
    assert error_m(method, frame) < error_m("dlt", frame) / 5


@pytest.mark.parametrize("method", ["robust", "plane", "surface"])
def test_the_same_corners_give_the_same_matrix(make_frame, method):
    def rough(points):
        return 0.1 * np.sin(points[..., 0])

    first, second = (fit(method, make_frame(PLACES, rough), GridSpec(), FitSettings()) for _ in range(2))
    assert first.bev_from_image.tobytes() == second.bev_from_image.tobytes()
