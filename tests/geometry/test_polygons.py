import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.geometry.polygons import clip_half_space, clip_near_plane, clip_rectangle

_radii = st.lists(st.floats(0.5, 40), min_size=3, max_size=12)
_shift = st.tuples(st.floats(-30, 30), st.floats(-30, 30))


def _star(radii, shift):
    angles = np.arange(len(radii)) * 2 * np.pi / len(radii)
    return np.array(shift) + np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _area(polygon):
    """By the shoelace formula; edges there and back cancel."""
    x, y = polygon.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@given(_radii, _shift)
def test_clipping_to_a_rectangle_keeps_the_area_that_shapely_finds(radii, shift):
    star = _star(radii, shift)
    clipped = clip_rectangle(star, (-10, -20), (25, 15))
    with np.errstate(invalid="ignore"):  # which shapely 2.0 raises on sound polygons too
        expected = shapely.intersection(shapely.Polygon(star), shapely.box(-10, -20, 25, 15)).area
    assert _area(clipped) == pytest.approx(expected, abs=1e-8)
    if len(clipped):
        assert (clipped.min(axis=0) >= np.array([-10, -20]) - 1e-9).all()
        assert (clipped.max(axis=0) <= np.array([25, 15]) + 1e-9).all()


def test_a_face_that_reaches_behind_the_camera_ends_at_the_near_plane():
    face = np.array([[-1.0, 1, -2], [1, 1, -2], [1, 1, 6], [-1, 1, 6]])
    by_hand = [[1, 1, 0.5], [1, 1, 6], [-1, 1, 6], [-1, 1, 0.5]]
    np.testing.assert_allclose(clip_near_plane(face, 0.5), by_hand)


def test_a_polygon_wholly_on_one_side_is_kept_as_it_is_or_vanishes():
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    np.testing.assert_array_equal(clip_half_space(triangle, np.ones(3)), triangle)
    assert clip_half_space(triangle, -np.ones(3)).shape == (0, 2)


def test_a_vertex_on_the_border_is_inside():
    triangle = np.array([[2.0, 0.0], [5.0, 1.0], [4.0, 3.0]])
    np.testing.assert_array_equal(clip_half_space(triangle, triangle[:, 0] - 2), triangle)
    np.testing.assert_array_equal(clip_half_space(triangle, 5 - triangle[:, 0]), triangle)
    # Only the vertex, or the side, on the border is left of what lies beyond it.
    np.testing.assert_array_equal(np.unique(clip_half_space(triangle, 2 - triangle[:, 0]), axis=0), [[2, 0]])
    square = np.array([[3.0, 1.0], [7.0, 1.0], [7.0, 2.0], [3.0, 2.0]])
    left = np.unique(clip_half_space(square, 3 - square[:, 0]), axis=0)
    np.testing.assert_array_equal(left, [[3, 1], [3, 2]])


def test_sides_are_cut_in_proportion_in_the_order_of_the_polygon():
    quadrilateral = np.array([[0.0, 0.0], [8.0, 2.0], [10.0, 10.0], [2.0, 6.0]])
    clipped = clip_half_space(quadrilateral, 5 - quadrilateral[:, 0])
    np.testing.assert_allclose(clipped, [[0, 0], [5, 1.25], [5, 7.5], [2, 6]])


def test_a_rectangle_s_own_borders_are_in_it_and_each_border_cuts_its_own_side():
    rectangle = np.array([[-3.0, 4.0], [7.0, 4.0], [7.0, 9.0], [-3.0, 9.0]])
    np.testing.assert_array_equal(clip_rectangle(rectangle, (-3, 4), (7, 9)), rectangle)
    clipped = clip_rectangle(rectangle, (-2, 5), (6, 8))
    assert {tuple(corner) for corner in clipped} == {(-2, 5), (6, 5), (6, 8), (-2, 8)}


def test_a_face_that_touches_the_near_plane_is_whole():
    face = np.array([[-1.0, 1, 0.5], [1, 1, 0.5], [1, 1, 6], [-1, 1, 6]])
    np.testing.assert_array_equal(clip_near_plane(face, 0.5), face)
