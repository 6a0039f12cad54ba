"""Plots as SVG and PDF: shapes lie where they are drawn, and files are what their formats say."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from ogmkit.drawing.palette import theme
from ogmkit.drawing.pdf import pdf_of
from ogmkit.drawing.svg import svg_of
from ogmkit.drawing.vector import Drawing

SPACE = "{http://www.w3.org/2000/svg}"
INK = 255, 0, 51


@pytest.fixture
def drawing():
    one = Drawing(100, 200)
    one.fill(10, 20, 30, 40, INK)
    one.polyline(np.array([[1.0, 2.0], [3.0, 4.0]]), INK, 3)
    one.dots(np.array([[50.0, 60.0]]), INK, 7.0)
    one.text("a < b & (c)", 190, 90, 20, INK, "right")
    return one


def test_svg_has_each_shape(drawing):
    root = ET.fromstring(svg_of(drawing))
    page, box = root.iter(f"{SPACE}rect")
    rim, disc = root.iter(f"{SPACE}circle")
    (line,), (text,) = root.iter(f"{SPACE}polyline"), root.iter(f"{SPACE}text")

    assert (page.get("width"), page.get("height")) == ("200", "100")
    assert [box.get(name) for name in ("x", "y", "width", "height", "fill")] == [
        *("10", "20", "30", "40"),
        "#ff0033",
    ]
    assert (line.get("points"), line.get("stroke-width")) == ("1,2 3,4", "3")
    assert [disc.get(name) for name in ("cx", "cy", "r")] == ["50", "60", "7"]
    assert rim.get("r") == "8.5"
    assert rim.get("fill") == "#{:02x}{:02x}{:02x}".format(*theme().page)
    assert (text.text, text.get("text-anchor"), text.get("x")) == ("a < b & (c)", "end", "190")


def test_pdf_has_each_shape_with_y_upward(drawing):
    data = pdf_of(drawing).decode("latin-1")

    assert "1.000 0.000 0.200 rg 10 40 30 40 re f" in data
    assert "3 w 1 98 m 3 96 l S" in data
    assert "57.00 40.00 m" in data
    # Helvetica: a 556, space 278, < 584, b 556, & 667, ( and ) 333, c 500; four spaces.
    width = (556 + 278 + 584 + 278 + 556 + 278 + 667 + 278 + 333 + 500 + 333) * 20 / 1000
    assert f"{190 - width:.2f} 10 Td (a < b & \\(c\\)) Tj" in data


def test_pdf_finds_its_objects(drawing):
    data = pdf_of(drawing)

    start = int(re.search(rb"startxref\n(\d+)\n", data)[1])
    assert data[start:].startswith(b"xref\n0 6\n")
    places = re.findall(rb"(\d{10}) 00000 n \n", data[start:])
    for number, place in enumerate(places, start=1):
        assert data[int(place) :].startswith(b"%d 0 obj\n" % number)
    length = int(re.search(rb"/Length (\d+)", data)[1])
    stream = data.index(b"stream\n") + 7
    assert data[stream + length :].startswith(b"\nendstream")
