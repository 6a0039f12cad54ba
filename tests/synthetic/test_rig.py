import numpy as np
import pytest
from pyquaternion import Quaternion

from ogmkit.errors import SettingsError
from ogmkit.synthetic.rig import CAMERA_MOUNTS, LIDAR_MOUNT, NATIVE_SIZE, scaled_intrinsics

HEADINGS_DEG = {
    "CAM_FRONT": 0,
    "CAM_FRONT_RIGHT": -55,
    "CAM_BACK_RIGHT": -110,
    "CAM_BACK": 180,
    "CAM_BACK_LEFT": 110,
    "CAM_FRONT_LEFT": 55,
}


@pytest.mark.parametrize("channel", CAMERA_MOUNTS)
def test_camera_looks_where_its_name_says_and_stands_upright(channel):
    mount = CAMERA_MOUNTS[channel]
    right, down, ahead = Quaternion(mount.rotation_wxyz).rotation_matrix.T
    turned = np.degrees(np.arctan2(ahead[1], ahead[0])) - HEADINGS_DEG[channel]
    assert abs((turned + 180) % 360 - 180) < 4
    assert down[2] < -0.999
    assert abs(right[2]) < 0.03
    assert np.linalg.norm(mount.rotation_wxyz) == pytest.approx(1, abs=1e-12)


def test_lidar_is_on_the_roof_with_z_up_and_x_to_the_right():
    x, _, z = Quaternion(LIDAR_MOUNT.rotation_wxyz).rotation_matrix.T
    assert z[2] > 0.999
    assert x[1] < -0.999
    assert LIDAR_MOUNT.translation_m[2] > max(mount.translation_m[2] for mount in CAMERA_MOUNTS.values())


def test_native_size_leaves_the_intrinsics_alone():
    mount = CAMERA_MOUNTS["CAM_FRONT"]
    intrinsics = scaled_intrinsics("CAM_FRONT", NATIVE_SIZE)
    assert intrinsics[0, 0] == intrinsics[1, 1] == mount.focal_px
    np.testing.assert_allclose(intrinsics[:2, 2], mount.centre_px)


def test_half_size_keeps_pixel_corners_not_centres():
    """The outer corner of the image, (−0.5, −0.5), stays put; so a pixel u moves to (u + 0.5) / 2 − 0.5."""
    full, half = (scaled_intrinsics("CAM_BACK", size) for size in ((900, 1600), (450, 800)))
    point = np.array([1.3, -0.4, 7.0])
    u, v, w = full @ point
    expected = ((u / w + 0.5) / 2 - 0.5, (v / w + 0.5) / 2 - 0.5)
    u, v, w = half @ point
    assert (u / w, v / w) == pytest.approx(expected, abs=1e-9)


def test_stretched_size_scales_each_axis_by_itself():
    intrinsics = scaled_intrinsics("CAM_FRONT", (900, 800))
    assert intrinsics[0, 0] == pytest.approx(633.2)
    assert intrinsics[1, 1] == pytest.approx(1266.4)


@pytest.mark.parametrize(("channel", "size"), [("CAM_ROOF", (450, 800)), ("CAM_FRONT", (0, 800))])
def test_unknown_camera_or_empty_size_is_refused(channel, size):
    with pytest.raises(SettingsError, match=r"CAM_ROOF|no pixels"):
        scaled_intrinsics(channel, size)
