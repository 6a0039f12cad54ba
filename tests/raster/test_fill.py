import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from ogmkit.raster.fill import fill_polygons, fill_spans

_SHAPE = (40, 30)
_corners = st.tuples(st.floats(-60, 90), st.floats(-60, 90))
_lattice = st.tuples(st.integers(-3, 33), st.integers(-3, 43))


def _picture(mask):
    return ["".join(".#"[cell] for cell in row) for row in mask]


def _centres(shape):
    columns, rows = np.meshgrid(np.arange(shape[1]), np.arange(shape[0]))
    return columns.ravel(), rows.ravel()


def _assert_like_shapely(mask, polygon):
    columns, rows = _centres(mask.shape)
    expected = shapely.contains_xy(polygon, columns, rows).reshape(mask.shape)
    near_border = shapely.distance(polygon.boundary, shapely.points(columns, rows)) < 1e-9
    differs = (mask != expected).ravel() & ~near_border
    assert not differs.any(), np.flatnonzero(differs)


@st.composite
def _stars(draw):
    """Rings that don't cross themselves: a radius in each of some directions, seldom convex."""
    radii = draw(st.lists(st.floats(0.01, 60), min_size=3, max_size=14))
    centre = np.array(draw(st.tuples(st.floats(-10, 40), st.floats(-10, 50))))
    angles = draw(st.floats(0, 7)) + np.arange(len(radii)) * 2 * np.pi / len(radii)
    return centre, centre + np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)


def test_an_l_shape_by_hand_shows_rows_down_and_columns_right():
    ring = np.array([[0.5, 0.5], [1.5, 0.5], [1.5, 2.5], [4.5, 2.5], [4.5, 3.5], [0.5, 3.5]])
    assert _picture(fill_polygons([ring], (5, 6))) == ["......", ".#....", ".#....", ".####.", "......"]


def test_a_centre_on_the_left_or_upper_border_is_inside_and_on_the_others_not():
    square = np.array([[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]])
    assert _picture(fill_polygons([square], (5, 5))) == [".....", ".##..", ".##..", ".....", "....."]


def test_a_car_of_2_by_4_metres_keeps_its_area():
    car = 10 * np.array([[10.003, 5.004], [10.003, 7.004], [14.003, 7.004], [14.003, 5.004]])
    assert fill_polygons([car], (100, 200)).sum() == 20 * 40


@given(_stars())
def test_simple_polygons_agree_with_shapely(star):
    _, ring = star
    _assert_like_shapely(fill_polygons([ring], _SHAPE), shapely.Polygon(ring))


@given(_stars(), st.floats(0.1, 0.9))
def test_polygons_with_a_hole_agree_with_shapely(star, share):
    centre, ring = star
    hole = centre + share * (ring - centre)
    mask = fill_polygons([ring, hole[::-1]], _SHAPE, polygon_of_ring=[0, 0])
    _assert_like_shapely(mask, shapely.Polygon(ring, [hole]))


@given(st.lists(st.lists(_corners, min_size=3, max_size=6), min_size=1, max_size=5))
def test_polygons_unite_where_they_overlap(rings):
    rings = [np.array(ring) for ring in rings]
    apart = [fill_polygons([ring], _SHAPE) for ring in rings]
    assert_array_equal(fill_polygons(rings, _SHAPE), np.bitwise_or.reduce(apart))


@given(st.lists(st.lists(_corners, min_size=3, max_size=6), min_size=1, max_size=4))
def test_rings_of_one_polygon_are_even_odd(rings):
    rings = [np.array(ring) for ring in rings]
    apart = [fill_polygons([ring], _SHAPE) for ring in rings]
    together = fill_polygons(rings, _SHAPE, polygon_of_ring=[0] * len(rings))
    assert_array_equal(together, np.bitwise_xor.reduce(apart))


@given(st.lists(_lattice, min_size=3, max_size=9))
def test_triangles_that_share_borders_leave_no_gap_and_no_overlap(corners):
    # On lattice points every border runs through centres. A fan of triangles adds up, modulo 2, to the ring.
    ring = np.array(corners, dtype=float)
    triangles = [fill_polygons([ring[[0, i, i + 1]]], _SHAPE) for i in range(1, len(ring) - 1)]
    assert_array_equal(fill_polygons([ring], _SHAPE), np.bitwise_xor.reduce(triangles))


@given(st.lists(_corners, min_size=3, max_size=8), st.integers(0, 7))
def test_orientation_starting_point_and_closing_vertex_do_not_matter(corners, start):
    ring = np.array(corners)
    mask = fill_polygons([ring], _SHAPE)
    assert_array_equal(fill_polygons([ring[::-1]], _SHAPE), mask)
    assert_array_equal(fill_polygons([np.roll(ring, start, axis=0)], _SHAPE), mask)
    assert_array_equal(fill_polygons([np.vstack([ring, ring[:1]])], _SHAPE), mask)


@given(st.lists(_corners, min_size=3, max_size=8), st.integers(-20, 20), st.integers(-20, 20))
def test_a_window_of_the_grid_shows_what_the_grid_shows(corners, column, row):
    ring = np.round(np.array(corners) * 8) / 8  # exact in binary, so that moving rounds nothing
    large = fill_polygons([ring + 25], (100, 90))
    window = fill_polygons([ring - [column, row]], _SHAPE)
    # A move rounds crossings differently: only cells with a border through their centre may differ.
    differs = large[25 + row : 65 + row, 25 + column : 55 + column] != window
    rows, columns = np.nonzero(differs)
    border = shapely.LinearRing(ring - [column, row])
    with np.errstate(invalid="ignore"):  # which shapely 2.0 raises on rings with repeated corners
        away = shapely.distance(border, shapely.points(columns, rows))
    assert (away < 1e-9).all()


@pytest.mark.parametrize(
    "ring",
    [
        [[2.0, 2.0]],
        [[2.0, 2.0], [9.0, 9.0]],
        [[2.0, 2.0]] * 5,
        [[1.0, 1.0], [5.0, 5.0], [9.0, 9.0]],
        [[3.1, 3.1], [3.2, 3.1], [3.2, 3.2]],
        [[-50.0, -50.0], [-40.0, -50.0], [-40.0, 90.0]],
        [[50.0, -50.0], [90.0, 20.0], [50.0, 90.0]],
    ],
)
def test_rings_without_a_centre_inside_the_grid_mark_nothing(ring):
    assert not fill_polygons([np.array(ring)], _SHAPE).any()


def test_a_ring_far_larger_than_the_grid_marks_all_of_it():
    assert fill_polygons([1e12 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])], _SHAPE).all()


def test_a_long_thin_ring_through_the_grid_is_cut_exactly():
    # Columns 10.2 to 12.4 at row 20, leaning one column in 10,000 rows.
    sliver = np.array([[-89.8, -1e6 + 20], [-87.6, -1e6 + 20], [112.4, 1e6 + 20], [110.2, 1e6 + 20]])
    expected = np.zeros(_SHAPE, np.uint8)
    expected[:, 11:13] = 1
    assert_array_equal(fill_polygons([sliver], _SHAPE), expected)


def test_a_bow_tie_is_filled_on_both_sides():
    tie = np.array([[0.5, 0.5], [6.5, 4.5], [6.5, 0.5], [0.5, 4.5]])
    by_hand = ["........", ".#....#.", ".##..##.", ".##..##.", ".#....#.", "........"]
    assert _picture(fill_polygons([tie], (6, 8))) == by_hand


def test_nothing_to_fill_gives_an_empty_mask():
    for rings in ([], np.empty((0, 4, 2)), [np.empty((0, 2))]):
        mask = fill_polygons(rings, (3, 4))
        assert mask.shape == (3, 4)
        assert mask.dtype == np.uint8
        assert not mask.any()


def test_spans_are_half_open_clipped_and_may_overlap():
    rows = np.array([0, 1, 1, 2])
    mask = fill_spans(rows, np.array([1.0, -9, 1.5, 2.1]), np.array([3.0, 1.0, np.inf, 2.9]), (3, 5))
    assert _picture(mask) == [".##..", "#.###", "....."]
