"""Regions by hand, on the paper's grid and on others."""

from fractions import Fraction

import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.metrics.regions import REGIONS, region_masks


def box(shape, rows, columns):
    mask = np.zeros(shape, bool)
    mask[rows, columns] = True
    return mask


def test_on_the_papers_grid_they_are_the_designs_rows_and_columns():
    masks = region_masks(GridSpec())

    assert tuple(masks) == REGIONS
    assert masks["full"].all()
    np.testing.assert_array_equal(masks["close"], box((1000, 550), slice(500, 1000), slice(200, 400)))
    np.testing.assert_array_equal(masks["far"], box((1000, 550), slice(0, 500), slice(None)))


def test_close_ends_at_the_ego_where_the_grid_reaches_behind_it():
    masks = region_masks(GridSpec(0.5, rows=140, columns=60, ego_row=120, ego_column=34))

    # 50 m are 100 rows before row 120; 10 m are 20 columns to each side of column 34.
    np.testing.assert_array_equal(masks["close"], box((140, 60), slice(20, 120), slice(14, 54)))
    np.testing.assert_array_equal(masks["far"], box((140, 60), slice(0, 20), slice(None)))


def test_a_cell_that_a_border_cuts_belongs_to_neither():
    masks = region_masks(GridSpec(3.0, rows=20, columns=9, ego_row=20, ego_column=4.5))

    # Rows of 3 m: the one from 48 to 51 m ahead is row 3. Columns within ±10 m of the ego: ±3 whole ones and
    # a half, so 1.2 … 7.8 columns from the left: 2 … 6.
    np.testing.assert_array_equal(masks["close"], box((20, 9), slice(4, 20), slice(2, 7)))
    np.testing.assert_array_equal(masks["far"], box((20, 9), slice(0, 3), slice(None)))


def test_a_short_grid_has_nothing_far():
    masks = region_masks(GridSpec(0.1, rows=500, columns=30, ego_row=500, ego_column=20))

    assert masks["close"].all()
    assert not masks["far"].any()


def whole_cells(grid, near_m, far_m, right_m, left_m):
    """The cells whose four corners all lie between these metres, cell by cell in decimal fractions."""
    m, ego_row, ego_column = (
        Fraction(str(number)) for number in (grid.m_per_cell, grid.ego_row, grid.ego_column)
    )
    ahead = [m * (ego_row - row) for row in range(grid.rows + 1)]
    left = [m * (ego_column - column) for column in range(grid.columns + 1)]
    rows = [near_m <= ahead[row + 1] and ahead[row] <= far_m for row in range(grid.rows)]
    columns = [right_m <= left[column + 1] and left[column] <= left_m for column in range(grid.columns)]
    return np.outer(rows, columns)


@pytest.mark.parametrize(
    "grid",
    [
        GridSpec(0.3, rows=200, columns=110, ego_row=190, ego_column=40),
        GridSpec(0.7, rows=90, columns=50, ego_row=80.5, ego_column=21.25),
        GridSpec(1.0, rows=75, columns=31, ego_row=70, ego_column=12),
        GridSpec(2.5, rows=40, columns=30, ego_row=33, ego_column=7),
        GridSpec(0.1, rows=620, columns=230, ego_row=610, ego_column=90),
        GridSpec(10.0, rows=9, columns=6, ego_row=7, ego_column=2),
    ],
    ids=lambda grid: f"{grid.m_per_cell} m",
)
def test_cells_lie_wholly_in_their_region(grid):
    masks = region_masks(grid)

    np.testing.assert_array_equal(masks["close"], whole_cells(grid, 0, 50, -10, 10))
    np.testing.assert_array_equal(masks["far"], whole_cells(grid, 50, 10**9, -(10**9), 10**9))
    assert masks["close"].any()
    assert masks["close"].shape == masks["far"].shape == masks["full"].shape == grid.shape
