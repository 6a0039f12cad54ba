"""Colours of map layers, classes and instances: what lies on top, and what is told apart."""

from typing import get_args

import numpy as np
import pytest

from ogmkit.drawing import legend
from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.further_cells import LAYERS, class_colours, draw_way, instance_colours, layer_colours
from ogmkit.drawing.palette import THEMES, theme, themed
from ogmkit.nuscenes.expansion import Layer

SIDE = 40
MARKS = "vehicle", "first", "second", "future"


def square(value):
    return np.full((SIDE, SIDE), value, np.uint8)


def columns(first, last):
    """1 in some columns."""
    mask = square(0)
    mask[:, first:last] = 1
    return mask


def colour_at(pixels, row, column):
    return tuple(pixels[row, column].tolist())


def shares(pixels):
    found, counts = np.unique(pixels.reshape(-1, 3), axis=0, return_counts=True)
    return dict(zip(map(tuple, found.tolist()), (counts / counts.sum()).tolist(), strict=True))


def test_every_layer_of_the_map_has_a_colour_of_its_own():
    assert set(LAYERS) == set(get_args(Layer))
    assert len(set(LAYERS.values())) == len(LAYERS)


@pytest.mark.parametrize("name", THEMES)
def test_later_layers_lie_on_top_and_the_edge_of_the_view_on_all(name):
    layers = {"lane_divider": columns(20, 22), "lane": columns(10, 30), "drivable_area": columns(0, 30)}
    with themed(name):
        pixels = layer_colours(layers, columns(5, SIDE))
        row = [colour_at(pixels, 7, column) for column in (2, 5, 8, 15, 20, 35)]
        expected = ("drivable", "text", "drivable", "lane", "future", "ground")

        assert row == [getattr(theme(), colour) for colour in expected]


def test_twelve_classes_are_told_apart():
    nothing, seen = square(0), square(1)
    drawn = [
        class_colours([nothing] * place + [seen] + [nothing] * (11 - place), nothing, seen)
        for place in range(12)
    ]

    assert len({pixels.tobytes() for pixels in drawn}) == 12
    for place, pixels in enumerate(drawn):
        mark = getattr(theme(), MARKS[place % 4])
        assert shares(pixels) == ({mark: 1} if place < 4 else {mark: 0.5, theme().ground: 0.5})


def test_later_classes_lie_on_top_of_earlier_ones_and_of_the_drivable_area():
    pixels = class_colours([columns(10, 30), columns(20, 30)], columns(0, 30), square(1))

    colours = [colour_at(pixels, 7, column) for column in (5, 15, 25, 35)]
    assert colours == [theme().drivable, theme().vehicle, theme().first, theme().ground]


def test_an_instance_keeps_its_colour_over_the_outline_of_what_follows():
    numbers = np.zeros((SIDE, SIDE), np.uint16)
    numbers[:, 10:14], numbers[:, 20:24], numbers[:, 30:34] = 1, 2, 401
    later = square(0)
    later[10:20, 12:18] = 1
    pixels = instance_colours(numbers, later, square(1), square(1))

    row = [colour_at(pixels, 15, column) for column in (5, 12, 15, 17, 18, 22, 32)]
    marks = ("drivable", "vehicle", "drivable", "text", "drivable", "first", "vehicle")
    assert row == [getattr(theme(), mark) for mark in marks]


def test_a_way_is_seen_on_a_vehicle_by_its_rim():
    canvas = Canvas(SIDE, SIDE, theme().future)
    draw_way(canvas, np.array([[10.0, 20.0], [30.0, 20.0]]))

    assert colour_at(canvas.pixels, 20, 15) == theme().text
    assert {colour_at(canvas.pixels, row, 15) for row in (18, 22)} != {theme().future}
    assert colour_at(canvas.pixels, 20, 30) == theme().text


def test_the_legend_names_what_there_is_in_the_order_of_drawing():
    heading, entries = legend.layer_group(["lane", "drivable_area"])
    swatches = list(entries())
    assert heading == "Map layers"
    assert [label for _, label in swatches] == ["drivable area", "lane"]
    assert [shares(swatch) for swatch, _ in swatches] == [{theme().drivable: 1}, {theme().lane: 1}]

    _, entries = legend.class_group(["car", "large"])
    swatches = list(entries())
    assert [label for _, label in swatches] == ["car", "large"]
    assert [shares(swatch) for swatch, _ in swatches] == [{theme().vehicle: 1}, {theme().first: 1}]
    assert {swatch.shape for swatch, _ in legend.INSTANCES[1]()} == {swatches[0][0].shape}
