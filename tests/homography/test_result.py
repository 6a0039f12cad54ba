import numpy as np

from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec
from ogmkit.homography.methods import fit
from ogmkit.homography.result import estimates
from ogmkit.homography.settings import FitSettings

BELOW_AND_ABOVE_THE_HORIZON = np.array([[800.0, 700.0], [900.0, 600.0], [800.0, 300.0]])


def judged(matrix, probed):
    return estimates(
        matrix[None], [""], np.array([2]), BELOW_AND_ABOVE_THE_HORIZON, np.array([probed], dtype=bool)
    )


def calibrated(make_frame):
    frame = make_frame([])
    return np.linalg.inv(image_from_ground(frame.intrinsics, frame.level_from_camera))


def test_either_sign_of_a_matrix_becomes_the_one_that_sees_the_ground(make_frame):
    matrix = calibrated(make_frame)
    for sign in (1, -1):
        np.testing.assert_array_equal(judged(sign * matrix, [1, 1, 0]).level_from_image[0], matrix)


def test_a_horizon_between_the_corners_is_refused(make_frame):
    found = judged(calibrated(make_frame), [1, 1, 1])
    assert found.reasons == ("the horizon would run through the corners",)
    assert not found.valid.any()
    assert np.isnan(found.level_from_image).all()


def test_a_mirrored_image_is_refused(make_frame):
    found = judged(np.diag([1.0, -1.0, 1.0]) @ calibrated(make_frame), [1, 1, 0])
    assert found.reasons == ("the ground would be seen from below",)


def test_a_matrix_that_is_not_finite_is_refused(make_frame):
    matrix = calibrated(make_frame)
    matrix[1, 1] = np.nan
    assert judged(matrix, [1, 1, 0]).reasons == ("the fit did not converge",)


def test_residuals_worked_by_hand(make_frame):
    # Raised by h, corners land 1.5 / (1.5 − h) as far from the camera's foot as they are: 10 cells a metre.
    frame = make_frame([(21.7, 0.0)], raised_m=0.3)
    result = fit("calibration", frame, GridSpec(), FitSettings())
    from_camera = frame.ground_corners_level[0, :, :2] - [1.7, 0.0]
    np.testing.assert_allclose(result.rms_cells, 10 * 0.25 * np.sqrt((from_camera**2).sum(axis=1).mean()))
    np.testing.assert_allclose(result.rms_px, np.sqrt(((1266 * 0.3 / from_camera[:, 0]) ** 2).mean()))


def test_a_residual_above_the_horizon_is_infinite(make_frame):
    result = fit("calibration", make_frame([(30, 0)], raised_m=2.0), GridSpec(), FitSettings())
    assert result.valid
    assert result.rms_cells == np.inf
