"""The plot of left-out errors: dots stand where their values are."""

import math
import re
import xml.etree.ElementTree as ET
from itertools import pairwise

import numpy as np
import pytest

from ogmkit.drawing.canvas import text_width
from ogmkit.drawing.palette import theme
from ogmkit.homography.leave_out import LeftOutErrors
from ogmkit.pictures.homography_plot import Axis, _numbers, draw, write_plot
from ogmkit.pipeline.homography_fit import HomographySummary
from ogmkit.pipeline.homography_summary import MethodResults, MethodSummary


def method(name, error_m, range_m, refused=None):
    """A method with these errors, in one frame."""
    error_m = np.array(error_m, dtype=float)
    refused = np.zeros(len(error_m), bool) if refused is None else np.array(refused)
    errors = LeftOutErrors(np.ones(len(error_m), bool), refused, error_m, np.array(range_m, dtype=float))
    one = np.ones(1)
    return MethodSummary(name, MethodResults(one.astype(bool), ("",), one, one, errors))


def summary(*methods):
    return HomographySummary(methods, shards=1, kept=0, seconds=1.0)


def dots(pixels, colour):
    """Middle columns of the discs of a colour in each row of the table, legend left out."""
    rows, columns = (pixels[222:-96] == colour).all(axis=2).nonzero()
    return {int(row): columns[rows // 68 == row] for row in np.unique(rows // 68)}


@pytest.mark.parametrize(
    ("values", "ticks"),
    [
        ([0.7, 3.0], (0.5, 1, 2, 5)),
        ([1.0, 5.0], (1, 2, 5, 10)),
        ([1.0], (1, 2)),
        ([], (1, 2)),
        ([math.nan, math.inf, 0.0], (1, 2)),
        ([math.nan, 0.3, math.inf], (0.2, 0.5)),
        ([0.004, 0.03], (0.002, 0.005, 0.01, 0.02, 0.05)),
        ([1.0, 99.0], (1, 2, 5, 10, 20, 50, 100)),
        ([1.0, 100.0], (1, 10, 100, 1000)),
        ([0.004, 30.0], (0.001, 0.01, 0.1, 1, 10, 100)),
    ],
)
def test_ticks_are_round_and_enclose_the_values(values, ticks):
    assert Axis(values).ticks_m == ticks


def test_ticks_end_at_a_millimetre_and_a_kilometre():
    ticks = Axis([1e-9, 1e9]).ticks_m

    assert (ticks[0], ticks[-1]) == (0.001, 1000)


def test_the_axis_is_logarithmic_and_beyond_its_ends_values_stop():
    axis = Axis([1.0, 99.0])

    assert axis.ticks_m == (1, 2, 5, 10, 20, 50, 100)
    assert axis.pixel(10) == pytest.approx((axis.pixel(1) + axis.pixel(100)) / 2, abs=1)
    assert axis.pixel(0) == axis.pixel(1) < axis.pixel(2)
    assert axis.pixel(math.inf) == axis.pixel(100)


def test_dots_stand_at_median_and_90th_percentile():
    # One box in each range: median and 90th percentile are the same, so the median's dot covers the other.
    one = method("one", [1.0, 10.0, 50.0], [10, 30, 50])
    pixels = draw(summary(one))
    axis = Axis([1.0, 50.0])
    medians = dots(pixels, theme().first)[0]

    left = [40 + 184 + place * (420 + 104 + 32) for place in range(3)]
    expected = [left[place] + axis.pixel(value) for place, value in enumerate((1.0, 10.0, 50.0))]
    for x in expected:
        nearby = medians[abs(medians - x) < 20]
        assert nearby.mean() == pytest.approx(x, abs=0.5)
    assert (abs(medians[:, None] - expected).min(axis=1) < 20).all()


def test_the_90th_percentile_stands_to_the_right_of_the_median_in_its_row():
    wide = method("wide", [1, 1, 1, 1, 40], [10] * 5)
    narrow = method("narrow", [1, 1, 1, 1, 1.5], [10] * 5)
    pixels = draw(summary(wide, narrow))
    medians, p90s = dots(pixels, theme().first), dots(pixels, theme().second)

    assert medians[0].mean() == pytest.approx(medians[1].mean(), abs=0.5)
    assert p90s[0].mean() > p90s[1].mean() + 40 > medians[1].mean()


def test_methods_without_an_answer_have_no_dots_and_infinite_ones_stop_at_the_end():
    refused = method("refused", [math.nan] * 3, [10, 30, 50], [True] * 3)
    horizon = method("horizon", [2.0, 2.0, math.inf], [10, 30, 50])
    pixels = draw(summary(refused, horizon))
    medians = dots(pixels, theme().first)

    assert sorted(medians) == [1]
    end = 40 + 184 + 2 * (420 + 104 + 32) + Axis([2.0]).pixel(math.inf)
    assert medians[1].max() == pytest.approx(end + 7, abs=1.5)


def test_the_picture_grows_with_its_methods():
    one = method("one", [1.0], [10])
    heights = [draw(summary(*[one] * count)).shape[0] for count in (1, 2, 6)]

    assert heights == [heights[0], heights[0] + 68, heights[0] + 5 * 68]


def test_vector_files_hold_the_same_dots_and_letters(tmp_path):
    found = summary(method("one (1)", [1.0, 10.0, 50.0], [10, 30, 50]))
    for name in ("plot.svg", "plot.PDF", "plot.png"):
        write_plot(tmp_path / name, found)
    height, width, _ = draw(found).shape
    svg = ET.fromstring((tmp_path / "plot.svg").read_text(encoding="utf-8"))
    pdf = (tmp_path / "plot.PDF").read_bytes()

    assert (svg.get("width"), svg.get("height")) == (str(width), str(height))
    space = "{http://www.w3.org/2000/svg}"
    median = "#{:02x}{:02x}{:02x}".format(*theme().first)
    circles = [one for one in svg.iter(f"{space}circle") if one.get("fill") == median]
    left = [40 + 184 + place * (420 + 104 + 32) for place in range(3)]
    axis = Axis([1.0, 50.0])
    expected = [left[place] + axis.pixel(value) for place, value in enumerate((1.0, 10.0, 50.0))]
    assert [float(one.get("cx")) for one in circles[:3]] == expected
    letters = [one.text for one in svg.iter(f"{space}text")]
    assert {"Left-out vehicles", "one (1)", "1 vehicle", "refused"} <= set(letters)
    assert b"/MediaBox [0 0 %d %d]" % (width, height) in pdf
    assert rb"(one \(1\)) Tj" in pdf
    assert pdf.count(b" c ") + pdf.count(b" c\n") >= 4 * len(expected)
    assert len(re.findall(rb"Tj", pdf)) == len(letters)
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")


def test_numbers_of_ticks_leave_room_for_each_other():
    axis = Axis([0.004, 0.03, 0.0015])

    chosen = _numbers(axis)
    ends = [(axis.pixel(tick), text_width(text, 18) / 2) for tick, text in chosen]
    assert chosen[0][1] == f"{axis.ticks_m[-1]:g} m"
    assert len(chosen) < len(axis.ticks_m)
    for (right, half_right), (left, half_left) in pairwise(ends):
        assert left + half_left < right - half_right
