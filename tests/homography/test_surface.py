import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.homography.leave_out import left_out_errors
from ogmkit.homography.methods import fit
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings

GRID = GridSpec()


def hill(points_m):
    return 0.05 * points_m[..., 0] + 0.0003 * points_m[..., 0] ** 2


def landed_m(frame, places):
    heights = hill(places)
    pixels, _ = frame.project_level(np.concatenate([places, heights[:, None]], axis=1))
    matrix = fit("surface", frame, GRID, FitSettings()).bev_from_image
    return GRID.positions_m(apply(matrix, pixels)[0])


def test_on_a_slope_it_follows_the_ground(make_frame):
    places = np.array([[10.0, 2.0], [20.0, -3.0], [35.0, 4.0], [45.0, -5.0]])
    error_m = np.linalg.norm(landed_m(make_frame(ground=hill), places) - places, axis=1)
    assert (error_m < [0.25, 0.25, 0.5, 1.0]).all()


@pytest.mark.parametrize("heading_rad", [np.pi / 2, np.pi, -2.0])
def test_cameras_that_look_elsewhere_answer_alike(make_frame, heading_rad):
    def hill_seen_alike(points_m):
        ahead = points_m @ [np.cos(heading_rad), np.sin(heading_rad)]
        return 0.05 * ahead + 0.0003 * ahead**2

    front, turned = make_frame(ground=hill), make_frame(ground=hill_seen_alike, heading_rad=heading_rad)
    pixel = np.array([[700.0, 700.0]])
    matrices = [fit("surface", frame, GRID, FitSettings()).bev_from_image for frame in (front, turned)]
    ahead, aside = (GRID.positions_m(apply(matrix, pixel)[0])[0] for matrix in matrices)
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    # The cars' own headings are not turned with the camera, but bottoms are all that counts.
    np.testing.assert_allclose(aside, [[cosine, -sine], [sine, cosine]] @ ahead, atol=1e-6)


def test_on_a_slope_it_beats_the_calibration_at_boxes_left_out(make_frame):
    frame = make_frame(ground=hill)
    surface, calibration = (
        left_out_errors(method, frame, FitSettings()).error_m for method in ("surface", "calibration")
    )
    assert (surface < calibration / 3).all()


def test_the_settings_of_corners_do_not_touch_it(make_frame):
    frame = make_frame(ground=hill)
    strict = FitSettings(min_points=100, max_distance_m=1.0, categories=("nothing",))
    whole, restricted = (fit("surface", frame, GRID, settings) for settings in (FitSettings(), strict))
    np.testing.assert_array_equal(whole.bev_from_image, restricted.bev_from_image)


def test_a_camera_that_looks_at_the_sky_is_refused(make_frame):
    frame = make_frame([])
    up = frame.level_from_camera.copy()
    up[:3, :3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    result = fit("surface", make_frame([], level_from_camera=up), GRID, FitSettings())
    assert result.reason == "the camera does not see the ground"


def test_a_view_too_narrow_for_the_grid_falls_back_to_its_plane(make_frame):
    narrow = np.array([[3e4, 0, 816.0], [0, 3e4, 491.0], [0, 0, 1]])
    frame = make_frame([(30, 1), (20, -3)], hill, intrinsics=narrow)
    matrix = fit("surface", frame, GRID, FitSettings()).bev_from_image
    # Only a plane's homography has this form: x and y in the level frame keep their angle and their scale.
    ray_from_level = np.linalg.inv(narrow) @ np.linalg.inv(matrix) @ GRID.bev_from_level
    level = frame.level_from_camera[:3, :3] @ ray_from_level
    np.testing.assert_allclose(level[:2, :2] / level[0, 0], np.eye(2), atol=1e-9)
