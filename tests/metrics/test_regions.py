"""Regions by hand, on the paper's grid and on others."""

import numpy as np

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
