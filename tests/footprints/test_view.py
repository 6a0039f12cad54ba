import numpy as np

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
