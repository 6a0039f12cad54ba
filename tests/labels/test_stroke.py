"""Lines of thickness 2: by hand, and against OpenCV where it still draws them so."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.labels.stroke import stroke_two

VERSION = tuple(int(part) for part in cv2.__version__.split(".")[:2])
POINT = st.tuples(st.integers(-9, 40), st.integers(-9, 40))
LINE = st.lists(POINT, min_size=2, max_size=5).map(np.array)
SHAPE = (27, 31)


def stroked(points, shape=SHAPE):
    canvas = np.zeros(shape, np.uint8)
    stroke_two(canvas, np.array(points))
    return canvas


def test_a_level_line_is_three_cells_high_and_has_a_plus_at_each_end():
    expected = [[0, 0, 1, 1, 1, 0, 0], [0, 1, 1, 1, 1, 1, 0], [0, 0, 1, 1, 1, 0, 0]]
    assert stroked([(2, 1), (4, 1)], (3, 7)).tolist() == expected


def test_a_point_is_a_plus():
    assert stroked([(1, 1), (1, 1)], (3, 3)).tolist() == [[0, 1, 0], [1, 1, 1], [0, 1, 0]]


def test_what_lies_outside_is_left_out():
    assert not stroked([(-9, 3), (-3, 9)]).any()


@given(LINE)
def test_a_line_is_the_union_of_its_segments(points):
    segments = [stroked(points[i : i + 2]) for i in range(len(points) - 1)]
    np.testing.assert_array_equal(stroked(points), np.maximum.reduce(segments))


@given(LINE)
def test_a_thin_line_lies_in_it(points):
    thin = np.zeros(SHAPE, np.uint8)
    cv2.polylines(thin, [points.astype(np.int32)], False, 1)
    inside = (points >= 0).all() and (points < SHAPE[::-1]).all()
    assert not inside or (thin <= stroked(points)).all()


@pytest.mark.skipif(VERSION >= (4, 13), reason="OpenCV draws other strokes from 4.13 on")
@given(LINE)
def test_as_opencv_drew_them(points):
    expected = np.zeros(SHAPE, np.uint8)
    cv2.polylines(expected, [points.astype(np.int32)], False, 1, 2)
    np.testing.assert_array_equal(stroked(points), expected)
