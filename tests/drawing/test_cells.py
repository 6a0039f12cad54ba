"""Colours of cells: each state its own, and counted right."""

import math

import numpy as np
import pytest

from ogmkit.drawing.cells import agreement_colours, overlap, refined, target_colours
from ogmkit.drawing.palette import theme


def mask(*values):
    return np.array([values], np.uint8)


def test_vehicles_lie_on_drivable_area():
    colours = target_colours(mask(0, 1, 0, 1), mask(0, 0, 1, 1), mask(1, 1, 1, 1))

    expected = [theme().ground, theme().drivable, *[theme().vehicle] * 2]
    assert [tuple(colour) for colour in colours[0].tolist()] == expected


def square(value, side=40):
    return np.full((side, side), value, np.uint8)


def colours_of(pixels):
    """Each colour's share."""
    colours, counts = np.unique(pixels.reshape(-1, 3), axis=0, return_counts=True)
    shares = (counts / counts.sum()).tolist()
    return dict(zip(map(tuple, colours.tolist()), shares, strict=True))


def test_what_is_out_of_view_is_striped_with_the_ground():
    nothing, everywhere = square(0), square(1)

    half = pytest.approx(0.5)
    road = colours_of(target_colours(everywhere, nothing, nothing))
    assert road == {theme().ground: half, theme().drivable: half}
    vehicle = colours_of(target_colours(nothing, everywhere, nothing))
    assert vehicle == {theme().ground: half, theme().vehicle: half}
    assert colours_of(target_colours(everywhere, nothing, everywhere)) == {theme().drivable: 1}


def test_a_line_along_its_inner_side_shows_where_the_view_ends():
    seen = square(0)
    seen[:, 20:] = 1
    colours = target_colours(square(1), square(0), seen)

    assert [tuple(one) for one in colours[7, 19:23].tolist()][1:] == [theme().text, *[theme().drivable] * 2]
    assert tuple(colours[7, 19].tolist()) != theme().text
    assert tuple(colours[7, 39].tolist()) == theme().drivable  # the grid's own border is none


def test_stripes_are_as_wide_in_a_picture_whatever_the_cells():
    counts = []
    for side in (400, 1000):
        colours = target_colours(square(1, side), square(0, side), square(0, side))
        road = (colours[0] == theme().drivable).all(axis=-1)
        counts.append(np.count_nonzero(np.diff(road)))
    assert counts == pytest.approx([100, 100], abs=1)


def test_disagreement_on_the_drivable_area_is_striped_one_way_or_the_other():
    nothing, everywhere = square(0), square(1)
    half = pytest.approx(0.5)
    missed = agreement_colours((everywhere, nothing), (nothing, nothing), everywhere)
    added = agreement_colours((nothing, nothing), (everywhere, nothing), everywhere)

    assert colours_of(missed) == {theme().ground: half, theme().first: half}
    assert colours_of(added) == {theme().ground: half, theme().second: half}
    marked = (missed == theme().first).all(axis=-1)
    np.testing.assert_array_equal(marked[1:, :-1], marked[:-1, 1:])
    marked = (added == theme().second).all(axis=-1)
    np.testing.assert_array_equal(marked[1:, 1:], marked[:-1, :-1])


def test_agreement_on_vehicles_covers_that_on_drivable_area():
    nothing, everywhere = mask(0, 0, 0, 0), mask(1, 1, 1, 1)
    true, other = mask(0, 1, 0, 1), mask(0, 0, 1, 1)
    expected = [theme().first, theme().second, theme().vehicle]
    for drivable in (nothing, everywhere):
        colours = agreement_colours((drivable, true), (drivable, other), everywhere)[0].tolist()
        assert [tuple(colour) for colour in colours[1:]] == expected

    colours = agreement_colours((true, nothing), (other, nothing), everywhere)[0].tolist()
    assert (tuple(colours[0]), tuple(colours[3])) == (theme().ground, theme().drivable)


def test_nothing_is_compared_out_of_view():
    some, none = mask(1, 0, 1), mask(0, 0, 0)
    colours = agreement_colours((some, some), (none, some), none)

    assert len(np.unique(colours[0], axis=0)) == 1
    assert tuple(colours[0, 0].tolist()) == theme().ground


def test_masks_that_hold_other_numbers_than_1_are_set_all_the_same():
    odd, one = mask(0, 7, 255), mask(0, 1, 1)

    np.testing.assert_array_equal(target_colours(odd, odd, odd), target_colours(one, one, one))
    expected = agreement_colours((one, one), (one, one), one)
    np.testing.assert_array_equal(agreement_colours((odd, odd), (one, odd), odd), expected)


def test_overlap_counts_cells_in_view_only():
    true, other = mask(1, 1, 1, 0, 1), mask(1, 0, 1, 1, 1)

    assert overlap(true, other, mask(1, 1, 1, 1, 1)) == pytest.approx(3 / 5)
    assert overlap(true, other, mask(1, 1, 0, 0, 0)) == pytest.approx(1 / 2)
    assert math.isnan(overlap(true, other, mask(0, 0, 0, 0, 0)))
    assert overlap(true, mask(0, 0, 0, 0, 0), mask(1, 1, 1, 1, 1)) == 0


@pytest.mark.parametrize(("rows", "times"), [(4, 125), (48, 10), (300, 1), (1000, 1)])
def test_coarse_cells_are_repeated_up_to_the_scale_of_a_picture(rows, times):
    coarse = np.random.default_rng(rows).integers(0, 2, (rows, 3), np.uint8)

    fine = refined(coarse)

    assert fine.shape == (rows * times, 3 * times)
    assert (fine[::times, ::times] == coarse).all()
    assert (fine[times - 1 :: times, times - 1 :: times] == coarse).all()
