import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec
from ogmkit.homography.leave_out import left_out_errors
from ogmkit.homography.methods import METHODS, fit
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings

GRID = GridSpec(m_per_cell=0.2, rows=400, columns=260, ego_row=390.0, ego_column=150.0)
ALL = tuple(METHODS)
BY_CORNERS = ("dlt", "robust", "plane", "four-point")


def without(frame, make_frame, places, index):
    kept = [place for i, place in enumerate(places) if i != index]
    return make_frame(kept, hill)


def hill(points_m):
    return 0.0004 * points_m[..., 0] ** 2 + 0.01 * points_m[..., 1]


def test_the_names_are_those_of_the_command_line():
    assert ALL == ("surface", "dlt", "robust", "plane", "four-point", "calibration", "ego-plane")


@pytest.mark.parametrize("method", ALL)
@pytest.mark.parametrize("heading_rad", [0.0, 2.2, -1.9])
def test_in_a_flat_world_every_method_finds_the_calibration(make_frame, method, heading_rad):
    frame = make_frame(heading_rad=heading_rad)
    result = fit(method, frame, GRID, FitSettings())
    expected = GRID.bev_from_level @ np.linalg.inv(
        image_from_ground(frame.intrinsics, frame.level_from_camera)
    )
    assert (result.valid, result.reason) == (True, "")
    tolerance = 1e-3 if method == "four-point" else 1e-6  # OpenCV's float32
    np.testing.assert_allclose(
        result.bev_from_image, expected / abs(expected[2, 2]), rtol=tolerance, atol=tolerance
    )
    assert result.rms_px < tolerance * 10
    assert result.rms_cells < tolerance * 100


@pytest.mark.parametrize("method", ALL)
def test_scale_sign_and_horizon(make_frame, method):
    matrix = fit(method, make_frame(ground=hill), GRID, FitSettings()).bev_from_image
    assert matrix[2, 2] == -1.0
    below, above = np.array([[816.0, 890.0]]), np.array([[816.0, 100.0]])
    assert apply(matrix, below)[1] > 0
    assert apply(matrix, above)[1] < 0
    assert np.linalg.det(matrix) > 0


@pytest.mark.parametrize("method", ALL)
def test_points_used(make_frame, method):
    used = {"surface": 7, "four-point": 4, "calibration": 0, "ego-plane": 0}.get(method, 24)
    assert fit(method, make_frame(), GRID, FitSettings()).points_used == used


@pytest.mark.parametrize("method", ALL)
def test_leaving_a_box_out_is_fitting_a_frame_without_it(make_frame, method):
    places = [(9.0, 1.5), (14.0, -4.0), (21.0, 3.5), (28.0, -3.0), (36.0, 6.0)]
    frame = make_frame(places, hill)
    errors = left_out_errors(method, frame, FitSettings())
    assert errors.evaluated.all()
    for index in range(len(places)):
        matrix = fit(method, without(frame, make_frame, places, index), GRID, FitSettings()).bev_from_image
        landed = GRID.positions_m(apply(matrix, frame.ground_corners_px[index])[0])
        expected = np.linalg.norm(landed - frame.ground_corners_level[index, :, :2], axis=1).mean()
        assert errors.error_m[index] == pytest.approx(expected, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("method", BY_CORNERS)
def test_without_boxes_methods_that_need_them_say_so(make_frame, method):
    result = fit(method, make_frame([]), GRID, FitSettings())
    assert not result.valid
    assert "0 usable corners, fewer than" in result.reason
    assert np.isnan(result.bev_from_image).all()
    assert np.isnan([result.rms_px, result.rms_cells]).all()
    assert result.plane is None


@pytest.mark.parametrize("method", ["surface", "calibration", "ego-plane"])
def test_without_boxes_the_ground_under_the_wheels_still_answers(make_frame, method):
    frame = make_frame([])
    result = fit(method, frame, GRID, FitSettings())
    expected = image_from_ground(frame.intrinsics, frame.level_from_camera)
    at_20_m, _ = apply(expected, np.array([[20.0, 3.0]]))
    np.testing.assert_allclose(
        GRID.positions_m(apply(result.bev_from_image, at_20_m)[0]), [[20, 3]], atol=1e-6
    )


@pytest.mark.parametrize("method", BY_CORNERS)
def test_corners_in_a_line_are_refused(make_frame, method):
    in_a_line = make_frame([(10, 0), (20, 0), (30, 0)], yaw_rad=0.0, size=(0.0, 4.0, 1.5))
    result = fit(method, in_a_line, GRID, FitSettings())
    assert not result.valid
    assert "spread over only 0.00 m" in result.reason
    assert fit("surface", in_a_line, GRID, FitSettings()).valid


@pytest.mark.parametrize("method", ["dlt", "robust"])
def test_corners_in_a_line_are_refused_also_where_any_spread_will_do(make_frame, method):
    in_a_line = make_frame([(10, 0), (20, 0), (30, 0)], yaw_rad=0.0, size=(0.0, 4.0, 1.5))
    result = fit(method, in_a_line, GRID, FitSettings(min_spread_m=0.0))
    assert result.reason == "the corners are degenerate (three in a line, or too close together)"
    assert np.isnan(result.bev_from_image).all()


@pytest.mark.parametrize("method", BY_CORNERS)
def test_a_camera_under_the_road_is_refused(make_frame, method):
    ceiling = make_frame(ground=lambda points: np.full(points.shape[:-1], 3.0))
    result = fit(method, ceiling, GRID, FitSettings())
    assert result.reason == "the ground would be seen from below"


@pytest.mark.parametrize("method", ["surface", "calibration", "ego-plane"])
def test_a_camera_at_the_ground_is_refused(make_frame, method):
    frame = make_frame([])
    lowered = frame.level_from_camera.copy()
    lowered[2, 3] = 0.0
    assert not fit(method, make_frame([], level_from_camera=lowered), GRID, FitSettings()).valid


def test_least_number_of_corners(make_frame):
    one = make_frame([(12, 0)])
    assert fit("robust", one, GRID, FitSettings()).reason == "4 usable corners, fewer than 8"
    assert fit("robust", one, GRID, FitSettings(min_points=4)).valid
    assert fit("dlt", one, GRID, FitSettings()).valid
    assert fit("dlt", one, GRID, FitSettings(min_points=8)).reason == "4 usable corners, fewer than 8"


def test_an_unknown_method_is_named_with_the_known_ones(make_frame):
    with pytest.raises(SettingsError, match=r"'magic' is unknown: choose from surface, dlt"):
        fit("magic", make_frame(), GRID, FitSettings())


def test_a_horizon_through_the_first_pixel_leaves_no_scale(make_frame):
    shifted = make_frame().intrinsics.copy()
    shifted[1, 2] = 0.0
    result = fit("calibration", make_frame(intrinsics=shifted), GRID, FitSettings())
    assert result.reason == "the horizon runs through pixel (0, 0)"
