"""Colours of cells: each state its own, and counted right."""

import math

import numpy as np
import pytest

from ogmkit.pictures import cells
from ogmkit.pictures.canvas import PAGE
from ogmkit.pictures.cells import agreement_colours, overlap, target_colours


def mask(*values):
    return np.array([values], np.uint8)


def test_vehicles_lie_on_drivable_area():
    colours = target_colours(mask(0, 1, 0, 1), mask(0, 0, 1, 1), mask(1, 1, 1, 1))

    expected = [cells.GROUND_COLOUR, cells.DRIVABLE_COLOUR, *[cells.VEHICLE_COLOUR] * 2]
    assert [tuple(colour) for colour in colours[0].tolist()] == expected


def test_what_is_out_of_view_is_darker_but_told_apart():
    drivable, vehicles = mask(0, 1, 0), mask(0, 0, 1)
    unseen = target_colours(drivable, vehicles, mask(0, 0, 0))[0].tolist()
    seen = target_colours(drivable, vehicles, mask(1, 1, 1))[0].tolist()

    assert len({tuple(colour) for colour in unseen}) == 3
    for dark, bright in zip(unseen, seen, strict=True):
        assert sum(PAGE) < sum(dark) < sum(bright)


def test_agreement_on_vehicles_covers_that_on_drivable_area():
    nothing, everywhere = mask(0, 0, 0, 0), mask(1, 1, 1, 1)
    true, other = mask(0, 1, 0, 1), mask(0, 0, 1, 1)
    expected = [cells.ONLY_TRUE_COLOUR, cells.ONLY_OTHER_COLOUR, cells.VEHICLE_COLOUR]
    for drivable in (nothing, everywhere):
        colours = agreement_colours((drivable, true), (drivable, other), everywhere)[0].tolist()
        assert [tuple(colour) for colour in colours[1:]] == expected

    colours = agreement_colours((true, nothing), (other, nothing), everywhere)[0].tolist()
    assert tuple(colours[0]) == cells.GROUND_COLOUR
    assert tuple(colours[3]) == cells.DRIVABLE_COLOUR
    faint = {tuple(colours[1]), tuple(colours[2])}
    assert len(faint) == 2
    assert not faint & {*expected, cells.GROUND_COLOUR, cells.DRIVABLE_COLOUR}


def test_nothing_is_compared_out_of_view():
    some, none = mask(1, 0, 1), mask(0, 0, 0)
    colours = agreement_colours((some, some), (none, some), none)

    assert len(np.unique(colours[0], axis=0)) == 1
    assert (colours[0, 0] < cells.GROUND_COLOUR).all()


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
