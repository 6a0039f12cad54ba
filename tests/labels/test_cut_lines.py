"""Lines cut with convex polygons, against shapely up to the last bits."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.labels.cut_lines import cut_line

SQUARE = np.array([(5.0, -5.0), (5.0, 5.0), (-5.0, 5.0), (-5.0, -5.0)])
COORDINATE = st.integers(-900, 900).map(lambda hundredths: hundredths / 100 + 0.003)
LINE = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=2, max_size=8).map(np.array)


def test_a_line_in_and_out_gives_its_parts():
    line = np.array([(-8.0, 0.0), (0.0, 0.0), (0.0, 9.0), (2.0, 9.0), (2.0, 1.0)])
    first, second = cut_line(line, SQUARE)
    assert first.tolist() == [[-5.0, 0.0], [0.0, 0.0], [0.0, 5.0]]
    assert second.tolist() == [[2.0, 5.0], [2.0, 1.0]]


def test_a_segment_that_only_passes_through():
    (part,) = cut_line(np.array([(-8.0, -8.0), (8.0, 8.0)]), SQUARE)
    assert np.abs(part - [(-5.0, -5.0), (5.0, 5.0)]).max() < 1e-12


def test_what_stays_inside_is_as_it_was_and_what_stays_outside_is_gone():
    inside = np.array([(0.1, 0.2), (-3.0, 4.0)])
    (part,) = cut_line(inside, SQUARE)
    assert np.array_equal(part, inside)
    assert not list(cut_line(inside + 20, SQUARE))


@given(LINE, st.floats(-3.0, 3.0))
def test_as_shapely_cuts_them(line, turn_rad):
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    polygon = SQUARE @ np.array([[cos, sin], [-sin, cos]])
    found = shapely.MultiLineString(list(cut_line(line, polygon)))
    expected = shapely.intersection(shapely.LineString(line), shapely.Polygon(polygon))
    assert shapely.unary_union(found).length == pytest.approx(expected.length, abs=1e-6)
    assert found.length < 1e-9 or expected.buffer(1e-6).covers(found)
