"""The whole-number fill: by hand, against the rule a point at a time, and as sets."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.labels.fill import paint_convex, paint_outlined
from ogmkit.labels.outline import line_cells

SHAPE = (9, 13)
VERTEX = st.tuples(st.integers(-6, 19), st.integers(-6, 15))
RING = st.lists(VERTEX, min_size=1, max_size=6).map(np.array)


def filled(*rings, shape=SHAPE):
    canvas = np.zeros(shape, np.uint8)
    paint_outlined(canvas, [np.asarray(ring) for ring in rings], [0] * len(rings), [1])
    return canvas


def picture(*lines):
    return np.array([[character == "#" for character in line] for line in lines], np.uint8)


def test_a_rectangle_covers_its_border():
    expected = picture("......", ".###..", ".###..", "......")
    np.testing.assert_array_equal(filled([(1, 1), (3, 1), (3, 2), (1, 2)], shape=(4, 6)), expected)


def test_a_tilted_quad_by_hand():
    expected = picture("..#...", ".###..", "#####.", ".###..", "..#...")
    np.testing.assert_array_equal(filled([(2, 0), (4, 2), (2, 4), (0, 2)], shape=(5, 6)), expected)


def test_a_line_and_a_point_are_drawn_too():
    np.testing.assert_array_equal(filled([(0, 0), (4, 2)], shape=(3, 5)), picture("##...", "..##.", "....#"))
    np.testing.assert_array_equal(filled([(3, 1)] * 4, shape=(2, 5)), picture(".....", "...#."))


def test_rings_of_one_polygon_leave_a_hole_and_its_outline():
    outer, inner = [(0, 0), (6, 0), (6, 6), (0, 6)], [(2, 2), (4, 2), (4, 4), (2, 4)]
    canvas = filled(outer, inner, shape=(7, 7))
    assert canvas[3, 3] == 0
    assert canvas.sum() == 48


def test_a_hole_painted_over_erases_its_outline():
    outer, inner = np.array([(0, 0), (6, 0), (6, 6), (0, 6)]), np.array([(2, 2), (4, 2), (4, 4), (2, 4)])
    canvas = np.zeros((7, 7), np.uint8)
    paint_outlined(canvas, [outer, inner], [0, 1], [1, 0])
    assert canvas.sum() == 40


def test_clipping_a_drawn_line_is_not_drawing_a_clipped_one():
    far, shape = np.array([(-30, -7), (12, 8)]), (9, 13)
    clipped = filled(far, shape=shape)
    whole = filled(far + 40, shape=(60, 60))[40:49, 40:53]
    assert not np.array_equal(clipped, whole)


@given(st.lists(RING, min_size=1, max_size=3))
def test_as_the_rule_a_point_at_a_time(slow_fill, rings):
    np.testing.assert_array_equal(filled(*rings), slow_fill(rings, SHAPE))


@given(st.lists(RING, min_size=1, max_size=4))
def test_polygons_of_one_call_are_painted_in_order(rings):
    together, values = np.zeros(SHAPE, np.int32), range(3, 3 + len(rings))
    paint_outlined(together, rings, range(len(rings)), values)
    one_by_one = np.zeros(SHAPE, np.int32)
    for ring, value in zip(rings, values, strict=True):
        one_by_one[filled(ring) > 0] = value
    np.testing.assert_array_equal(together, one_by_one)


@given(RING)
def test_an_outline_lies_in_its_polygon(ring):
    _, cells = line_cells(np.roll(ring, 1, axis=0), ring, SHAPE)
    assert filled(ring).reshape(-1)[cells].all()


@given(RING, st.integers(0, 5))
def test_the_vertex_that_a_ring_begins_with_doesnt_matter(ring, turns):
    np.testing.assert_array_equal(filled(ring), filled(np.roll(ring, turns, axis=0)))


@given(VERTEX, VERTEX)
def test_a_lines_direction_matters_only_to_clipping(one, other):
    shape, ends = (40, 40), (np.array([one]) + 10, np.array([other]) + 10)
    there, back = line_cells(*ends, shape)[1], line_cells(*ends[::-1], shape)[1]
    assert set(there.tolist()) == set(back.tolist())


def test_nothing_is_painted_without_polygons():
    canvas = np.zeros(SHAPE, np.uint8)
    paint_outlined(canvas, [], [], [])
    paint_convex(canvas, [], [])
    assert not canvas.any()


def test_of_convex_rings_the_later_cover_the_earlier():
    canvas = np.zeros((4, 6), np.int32)
    square = np.array([(0, 0), (2, 0), (2, 2), (0, 2)])
    paint_convex(canvas, [square, square + 1], [7, 300])
    assert canvas[:, :4].tolist() == [
        [7, 7, 7, 0],
        [7, 300, 300, 300],
        [7, 300, 300, 300],
        [0, 300, 300, 300],
    ]
