from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from ogmkit.geometry.camera import project


def test_a_resized_view_sees_the_same_with_its_corners_in_place(make_view):
    view = make_view(image_size=(900, 1600), focal_px=1266.0)
    half = view.resized((450, 800))
    points = np.random.default_rng(0).uniform([-5, -5, 4], [5, 5, 60], (50, 3))
    pixels, _ = project(view.intrinsics, points)
    resized, _ = project(half.intrinsics, points)
    np.testing.assert_allclose(resized + 0.5, (pixels + 0.5) / 2)
    assert half.image_size == (450, 800)


def test_sides_may_shrink_by_different_factors(make_view):
    view = make_view(image_size=(100, 200))
    resized, _ = project(view.resized((50, 20)).intrinsics, np.array([1.0, 2.0, 10.0]))
    pixels, _ = project(view.intrinsics, np.array([1.0, 2.0, 10.0]))
    np.testing.assert_allclose(resized + 0.5, (pixels + 0.5) / (10, 2))


def test_the_camera_s_frame_is_found_once_by_the_inverse(make_view):
    view = make_view(yaw=40, pitch=-7, roll=3)
    np.testing.assert_allclose(
        view.camera_from_level, np.linalg.inv(view.level_from_camera), rtol=1e-12, atol=1e-12
    )
    assert view.camera_from_level is view.camera_from_level


def test_a_view_stays_as_it_is_and_equals_itself_alone(make_view):
    view = make_view()
    with pytest.raises(FrozenInstanceError):
        view.image_size = (1, 1)
    assert len({view, make_view()}) == 2  # == of arrays is no truth value
