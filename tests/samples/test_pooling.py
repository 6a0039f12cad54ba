"""The parts that masks are averaged over: as many of every map, nearly square; and the averages."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ogmkit.grid import GridSpec
from ogmkit.samples.pooling import equal_parts, part_counts, pooled_shape, shares

SIDE = st.integers(1, 2000)
CELLS = st.integers(1, 600_000)
LARGE = st.integers(100, 2000)


@pytest.mark.parametrize(
    ("shape", "cells", "expected"),
    [
        ((1000, 550), 5500, (100, 55)),  # the paper's grid
        ((448, 800), 5500, (55, 100)),  # and its camera view
        ((80, 48), 240, (20, 12)),
        ((64, 128), 240, (11, 21)),
        ((900, 1600), 5500, (56, 98)),
        ((3, 2000), 10, (1, 10)),
        ((3, 2), 6, (3, 2)),
    ],
)
def test_by_hand(shape, cells, expected):
    assert pooled_shape(shape, cells) == expected


@given(SIDE, SIDE, CELLS)
def test_parts_are_no_more_than_asked_for_and_no_smaller_than_pixels(rows, columns, cells):
    found = pooled_shape((rows, columns), cells)
    assert 1 <= found[0] <= rows
    assert 1 <= found[1] <= columns
    assert found[0] * found[1] <= cells
    if cells >= rows * columns:
        assert found == (rows, columns)


@given(SIDE, SIDE, CELLS)
def test_the_shorter_side_is_rounded_and_the_longer_one_filled(rows, columns, cells):
    found = pooled_shape((rows, columns), cells)
    (short, few), (long, many) = sorted(zip((rows, columns), found, strict=True), key=lambda side: side[0])
    square = min(Fraction(cells * short, long), Fraction(short) ** 2)  # of the shorter side's parts
    assert few == 1 or Fraction(2 * few - 1, 2) ** 2 <= square <= Fraction(2 * few + 1, 2) ** 2
    assert many == long or few * (many + 1) > cells


@given(LARGE, LARGE, LARGE, LARGE, st.integers(1000, 10_000))
def test_all_maps_give_nearly_the_same_number(rows, columns, other_rows, other_columns, cells):
    found = pooled_shape((rows, columns), cells), pooled_shape((other_rows, other_columns), cells)
    one, other = (height * width for height, width in found)
    assert one / other == pytest.approx(1, abs=0.05)


@given(SIDE, SIDE, CELLS)
def test_a_map_on_its_side_is_pooled_on_its_side(rows, columns, cells):
    assume(rows != columns)
    assert pooled_shape((columns, rows), cells) == pooled_shape((rows, columns), cells)[::-1]


@pytest.mark.parametrize(
    ("parts", "ego_column", "expected"),
    [
        ((4, 5), 12.0, True),  # on a part's edge
        ((4, 5), 14.0, True),  # in a part's middle
        ((4, 5), -6.0, True),
        ((8, 20), 12.5, True),  # parts of one cell
        ((4, 5), 13.0, False),
        ((4, 5), 12.5, False),
        ((3, 5), 12.0, False),
        ((4, 6), 12.0, False),
        ((4, 40), 12.0, False),
        ((0, 5), 12.0, False),
    ],
)
def test_parts_are_equal_where_they_divide_the_grid_on_both_sides_of_the_ego(parts, ego_column, expected):
    assert equal_parts(GridSpec(0.5, 8, 20, 8.0, ego_column), parts) is expected


@pytest.mark.parametrize(
    ("side", "dtype"), [(1, np.uint8), (10, np.uint8), (16, np.uint16), (300, np.uint32)]
)
def test_cells_are_counted_exactly_however_large_a_part_is(side, dtype):
    masks = np.random.default_rng(0).integers(0, 2, (2, 3 * side, 2 * side), dtype=np.uint8)
    masks[:, :side, :side] = 1
    counts = part_counts(masks, (3, 2))

    assert counts.dtype == dtype
    for row, column in np.ndindex(3, 2):
        part = masks[:, row * side : (row + 1) * side, column * side : (column + 1) * side]
        np.testing.assert_array_equal(counts[:, row, column], part.sum((1, 2), dtype=np.int64))
    averages = shares(counts, masks.shape[-2:])
    assert averages.dtype == np.float32
    np.testing.assert_array_equal(averages, (counts / side**2).astype(np.float32))
    assert (averages[:, 0, 0] == 1).all()
