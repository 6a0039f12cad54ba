import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.homography.corners import Corners, shortcomings, usable_boxes, usable_corners
from ogmkit.homography.settings import FitSettings


def test_by_default_vehicles_wholly_in_the_image_and_within_60_m_count(make_frame):
    places = [(10, 0), (20, 0), (61, 0), (8, 5.5), (-12, 0), (30, 0)]
    names = ("vehicle.car", "human.pedestrian.adult", *("vehicle.car",) * 3, "vehicle.bus.rigid")
    frame = make_frame(places, category=names)
    assert usable_boxes(frame, FitSettings()).tolist() == [True, False, False, False, False, True]


def test_a_box_nearer_than_one_metre_does_not_count(make_frame):
    wide = np.array([[100.0, 0, 800], [0, 100, 100], [0, 0, 1]])
    near = make_frame([(4.8, 0)], yaw_rad=0.0, intrinsics=wide)
    far = make_frame([(5.1, 0)], yaw_rad=0.0, intrinsics=wide)
    assert [usable_boxes(frame, FitSettings()).item() for frame in (near, far)] == [False, True]


def test_unknown_visibility_is_kept_by_every_filter(make_frame):
    frame = make_frame([(10, 0), (20, 0), (30, 0)], visibility=np.array([0, 2, 3], dtype=np.uint8))
    assert usable_boxes(frame, FitSettings(min_visibility=3)).tolist() == [True, False, True]


def test_unknown_numbers_of_lidar_points_are_kept_by_every_filter(make_frame):
    frame = make_frame([(10, 0), (20, 0), (30, 0)], num_lidar_pts=np.array([-1, 2, 3]))
    assert usable_boxes(frame, FitSettings(min_lidar_points=3)).tolist() == [True, False, True]


def test_corners_of_a_box_stand_together(make_frame):
    frame = make_frame([(-9, 0), (10, 0)])
    corners = usable_corners(frame, FitSettings())
    assert corners.box.tolist() == [1, 1, 1, 1]
    np.testing.assert_array_equal(corners.pixels, frame.ground_corners_px[1])
    assert corners.kept(np.array([-1, 0, 1])).any(axis=1).tolist() == [True, True, False]


def test_spread_is_the_least_standard_deviation_over_all_directions():
    square = np.array([[10.0, 0], [12, 0], [12, 2], [10, 2]])
    line = np.array([[10.0, 0], [20, 10], [30, 20], [40, 30]])
    corners = Corners(np.zeros((8, 2)), np.concatenate([square, line]), np.repeat([0, 1], 4))
    kept = corners.kept(np.array([1, 0]))
    assert shortcomings(corners, kept, 4, 0.99) == ["", "corners spread over only 0.00 m, less than 0.99 m"]
    assert shortcomings(corners, kept, 4, 1.01)[0] == "corners spread over only 1.00 m, less than 1.01 m"
    assert shortcomings(corners, kept, 5, 0.0) == ["4 usable corners, fewer than 5"] * 2


@pytest.mark.parametrize(
    "wrong",
    [
        {"min_points": 3},
        {"min_spread_m": -0.1},
        {"min_spread_m": float("nan")},
        {"max_distance_m": 0.0},
        {"max_distance_m": float("nan")},
        {"max_distance_m": float("inf")},
        {"categories": ()},
        {"min_visibility": 5},
    ],
)
def test_settings_out_of_range_are_refused(wrong):
    with pytest.raises(SettingsError, match=next(iter(wrong))):
        FitSettings(**wrong)
