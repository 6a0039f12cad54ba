"""Charts show the numbers that they are given."""

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.report import charts

NUMBERS = st.floats(-1e9, 1e9, allow_nan=False).filter(lambda value: abs(value) > 1e-6 or value == 0)


@given(NUMBERS, NUMBERS)
def test_ticks_are_round_and_hold_both_ends(one, other):
    low, high = sorted((one, other))
    found = charts.ticks(low, high)
    steps = np.diff(found)
    rounding = 1e-8 * (found[-1] - found[0])
    assert found[0] <= min(low, 0) + rounding
    assert found[-1] >= max(high, 0) - rounding
    assert 0 in found
    assert 2 <= len(found) <= 8
    assert np.allclose(steps, steps[0])


def test_ticks_of_some_ranges():
    assert charts.ticks(0, 230) == (0, 50, 100, 150, 200, 250)
    assert charts.ticks(0, 0) == (0, 0.2, 0.4, 0.6, 0.8, 1)
    assert charts.ticks(-3, 4) == (-4, -2, 0, 2, 4)


def test_a_bar_for_each_bin_that_has_something():
    found = charts.histogram(np.array([3, 0, 6]), np.array([0.0, 1, 2, 3]), {0: "0", 3: "3 m"})
    heights = [float(one) for one in re.findall(r'class="bar"[^>]*height="([\d.]+)"', found)]
    assert len(heights) == 2
    assert np.isclose(heights[1] / heights[0], 2, atol=0.01)
    assert "<title>2 to 3: 6</title>" in found


def test_the_map_has_forward_up_and_left_to_the_left():
    counts = np.zeros((2, 3), np.int64)
    counts[1, 2] = 5  # the farthest and leftmost bin
    found = charts.heat(counts, np.array([0.0, 10, 20]), np.array([-15.0, -5, 5, 15]), scale=1)
    ((x, y),) = re.findall(r'class="bar"[^>]* x="([\d.]+)" y="([\d.]+)"', found)
    ((left, top),) = re.findall(r'class="frame" x="([\d.]+)" y="([\d.]+)"', found)
    assert (float(x), float(y)) == (float(left), float(top))
    assert "10 m ahead, 5 m to the left: 5" in found


def test_curves_leave_out_what_is_not_finite_and_keep_their_colours():
    found = charts.curves({1: [(0, 1.0), (5, float("nan")), (10, 0.5)]}, ["one", "other"])
    (points,) = re.findall(r'points="([^"]+)"', found)
    assert len(points.split()) == 2
    assert 'class="line s1"' in found
    assert "other: 0.5 after 10 steps" in found
    assert "no finite value" in charts.curves({0: [(0, float("inf"))]}, ["one"])


def test_curves_beyond_the_colours_are_dashed():
    assert charts.style_of(charts.STYLES) == "line s0 dashed"
