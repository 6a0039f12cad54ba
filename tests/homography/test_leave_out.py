import math

import numpy as np
import pytest

from ogmkit.homography.leave_out import RANGES_M, LeftOutErrors, left_out_errors, summarise
from ogmkit.homography.settings import FitSettings


def errors(range_m, error_m, refused=None, evaluated=None):
    count = len(range_m)
    return LeftOutErrors(
        evaluated=np.ones(count, bool) if evaluated is None else np.array(evaluated),
        refused=np.zeros(count, bool) if refused is None else np.array(refused),
        error_m=np.array(error_m, float),
        range_m=np.array(range_m, float),
    )


def test_calibration_under_a_raised_car_errs_by_similar_triangles(make_frame):
    # Corners raised by h land 1.5 / (1.5 − h) as far from the camera's foot as they are.
    frame = make_frame([(21.7, 0.0)], raised_m=0.3)
    from_camera = frame.ground_corners_level[0, :, :2] - [1.7, 0.0]
    expected = np.linalg.norm(from_camera * (1.5 / 1.2 - 1), axis=1).mean()
    assert left_out_errors("calibration", frame, FitSettings()).error_m[0] == pytest.approx(expected)


def test_what_is_evaluated_does_not_depend_on_the_settings(make_frame):
    names = ("vehicle.car", "human.pedestrian.adult", "vehicle.truck")
    frame = make_frame([(10, 0), (20, 3), (30, 0)], category=names)
    for settings in (FitSettings(), FitSettings(categories=("human.",)), FitSettings(max_distance_m=5)):
        assert left_out_errors("dlt", frame, settings).evaluated.tolist() == [True, False, True]


def test_a_refusal_is_no_error_figure(make_frame):
    found = left_out_errors("dlt", make_frame([(10, 0)]), FitSettings())
    assert found.refused.tolist() == [True]
    assert np.isnan(found.error_m[0])


def test_a_corner_above_the_horizon_is_infinitely_wrong(make_frame):
    frame = make_frame([(30, 0)], raised_m=2.0)
    assert left_out_errors("calibration", frame, FitSettings()).error_m[0] == np.inf


def test_a_frame_without_boxes_has_no_errors(make_frame):
    found = left_out_errors("surface", make_frame([]), FitSettings())
    assert len(found.error_m) == 0
    assert [summary.boxes for summary in summarise([found])] == [0, 0, 0]


def test_summary_by_range_worked_by_hand():
    first = errors([5, 19.9, 20, 45, 60], [1, 2, 3, 9, 50])
    second = errors(
        [10, 30, 41, 12], [4, np.nan, 2, 99], [False, True, False, False], [True, True, True, False]
    )
    near, middle, far = summarise([first, second])
    assert (near.from_m, near.to_m) == RANGES_M[0]
    assert (near.boxes, near.median_m, near.refused_share) == (3, 2.0, 0.0)
    assert near.p90_m == pytest.approx(3.6)
    assert (middle.boxes, middle.median_m, middle.refused_share) == (2, 3.0, 0.5)
    assert (far.boxes, far.median_m) == (2, 5.5)


def test_summary_of_nothing_is_nan():
    for summary in summarise([]):
        assert summary.boxes == 0
        assert all(map(math.isnan, (summary.median_m, summary.p90_m, summary.refused_share)))


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_quantiles_are_numpys(count):
    values = np.random.default_rng(count).exponential(2, count)
    near = summarise([errors(np.full(count, 10.0), values)])[0]
    assert near.median_m == pytest.approx(np.median(values))
    assert near.p90_m == pytest.approx(np.quantile(values, 0.9))


def test_infinite_errors_stay_infinite():
    near = summarise([errors([1, 2, 3, 4], [1, 2, np.inf, np.inf])])[0]
    assert (near.median_m, near.p90_m) == (np.inf, np.inf)
