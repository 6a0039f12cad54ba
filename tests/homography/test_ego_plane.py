import numpy as np
import pytest

from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, pose_matrix, transform_points
from ogmkit.grid import GridSpec
from ogmkit.homography.ego_plane import ego_plane
from ogmkit.homography.methods import fit
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings

GRID = GridSpec(0.25, 240, 160, 200.0, 70.0)
ON_THE_GROUND = np.array([[6.0, 1.0, 0.0], [14.0, -5.0, 0.0], [40.0, 9.0, 0.0]])  # x, y, z of the ego frame


def tilted(make_frame, pitch, roll):
    """A frame whose body is pitched nose up and rolled, in degrees; the camera is mounted on the body."""
    level = make_frame()
    half_pitch, half_roll = -np.radians(pitch) / 2, np.radians(roll) / 2
    nose = pose_matrix([0, 0, 0], [np.cos(half_pitch), 0, np.sin(half_pitch), 0])
    side = pose_matrix([0, 0, 0], [np.cos(half_roll), np.sin(half_roll), 0, 0])
    body = nose @ side
    return make_frame(level_from_ego=body, level_from_camera=body @ level.level_from_camera)


@pytest.mark.parametrize(("pitch", "roll"), [(0, 0), (1.5, 0), (-2, 0), (0, 3), (2, -4)])
def test_ground_of_the_body_lands_where_the_level_frame_has_it(make_frame, pitch, roll):
    frame = tilted(make_frame, pitch, roll)
    camera_from_ego = inverse(frame.level_from_camera) @ frame.level_from_ego
    pixels, depth_m = project(frame.intrinsics, transform_points(camera_from_ego, ON_THE_GROUND))
    assert (depth_m > 1).all()

    found = fit("ego-plane", frame, GRID, FitSettings())

    mapped, w = apply(found.bev_from_image, pixels)
    expected = transform_points(frame.level_from_ego, ON_THE_GROUND)
    np.testing.assert_allclose(GRID.positions_m(mapped), expected[:, :2], atol=1e-9)
    assert (w > 0).all()
    heights = found.plane[0] + expected[:, :2] @ found.plane[1:]
    np.testing.assert_allclose(heights, expected[:, 2], atol=1e-12)


def test_boxes_have_no_say(make_frame):
    frame = tilted(make_frame, 1, 1)
    bare = make_frame([], level_from_ego=frame.level_from_ego, level_from_camera=frame.level_from_camera)
    found, without = (fit("ego-plane", one, GRID, FitSettings()) for one in (frame, bare))
    np.testing.assert_array_equal(found.bev_from_image, without.bev_from_image)


@pytest.mark.parametrize("roll", [100, 180])
def test_a_body_on_its_side_stands_on_no_ground(make_frame, roll):
    frame = tilted(make_frame, 0, roll)
    assert not fit("ego-plane", frame, GRID, FitSettings()).valid
    assert np.isnan(ego_plane(frame)).all()
