import numpy as np
import pytest

from ogmkit.errors import SettingsError


def test_geometry_of_one_car_worked_by_hand(make_frame):
    frame = make_frame([(21.7, 2.0)], yaw_rad=0.0, size=(2.0, 4.0, 1.5))
    np.testing.assert_allclose(frame.bottoms_level, [[21.7, 2.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(frame.ground_corners_level[0, 3], [19.7, 1.0, 0.0], atol=1e-12)
    # 18 m before the camera, 1.5 m under it, 1 m to its left.
    np.testing.assert_allclose(
        frame.ground_corners_px[0, 3], [816 - 1266 / 18, 491 + 1266 * 1.5 / 18], atol=1e-9
    )
    assert frame.range_m[0] == pytest.approx(np.hypot(21.7, 2.0))


@pytest.mark.parametrize("name", ["intrinsics", "level_from_camera", "level_from_box", "size_wlh"])
def test_numbers_that_are_not_finite_are_refused(make_frame, name):
    spoiled = getattr(make_frame(), name).copy()
    spoiled.flat[1] = np.nan
    with pytest.raises(SettingsError, match=f"{name} holds a number that is not finite"):
        make_frame(**{name: spoiled})


@pytest.mark.parametrize("name", ["intrinsics", "level_from_box", "size_wlh", "visibility"])
def test_shapes_that_disagree_are_refused(make_frame, name):
    with pytest.raises(SettingsError, match=f"{name} has shape"):
        make_frame(**{name: getattr(make_frame(), name)[:-1]})


def test_singular_intrinsics_are_refused(make_frame):
    with pytest.raises(SettingsError, match="singular"):
        make_frame(intrinsics=np.diag([1266.0, 0.0, 1.0]))
