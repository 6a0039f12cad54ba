import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.samples.coarse import coarse_grid, majority, repeat_cells


def test_a_coarse_grid_covers_the_same_ground():
    fine = GridSpec(0.1, 60, 40, 55.0, 12.0)

    own, factor = coarse_grid(fine, 0.5)

    assert factor == 5
    assert own.shape == (12, 8)
    assert own.x_range_m == pytest.approx(fine.x_range_m)
    assert own.y_range_m == pytest.approx(fine.y_range_m)


def test_the_paper_s_grid_at_a_metre():
    own, factor = coarse_grid(GridSpec(), 1.0)

    assert (own, factor) == (GridSpec(1.0, 100, 55, 100.0, 30.0), 10)


@pytest.mark.parametrize("cell_m", [0.05, 0.25, 0.1499, 0.0, -0.1, float("nan"), float("inf")])
def test_a_cell_that_is_no_whole_number_of_cells_is_refused(cell_m):
    with pytest.raises(
        SettingsError, match=r"BEV cell: .* is not a whole number of the shards' cells of 0\.1 m"
    ):
        coarse_grid(GridSpec(), cell_m)


@pytest.mark.parametrize("cell_m", [0.3, 0.4])
def test_a_cell_that_does_not_divide_the_grid_is_refused(cell_m):
    with pytest.raises(SettingsError, match="does not divide their grid of 60 rows × 50 columns"):
        coarse_grid(GridSpec(0.1, 60, 50), cell_m)


def test_majority_by_hand():
    mask = np.array(
        [
            [1, 0, 0, 0, 1, 1],
            [0, 1, 0, 0, 1, 1],
            [0, 0, 1, 1, 0, 0],
            [0, 1, 1, 0, 0, 0],
        ],
        np.uint8,
    )

    assert majority(mask, 2).tolist() == [[1, 0, 1], [0, 1, 0]]
    assert majority(np.stack([mask, 1 - mask]), 2).tolist() == [
        [[1, 0, 1], [0, 1, 0]],
        [[1, 1, 0], [1, 0, 1]],
    ]
    assert majority(mask, 2).dtype == np.uint8


def test_majority_of_an_odd_number_is_more_than_half():
    four, five = np.zeros((2, 3, 3), np.uint8)
    four.flat[:4] = five.flat[4:] = 1

    assert majority(np.stack([four, five]), 3).ravel().tolist() == [0, 1]


def test_majority_counts_past_a_byte():
    assert majority(np.ones((20, 40), np.uint8), 20).tolist() == [[1, 1]]


@given(st.integers(1, 4), st.integers(1, 5), st.integers(1, 5), st.integers(0, 99))
def test_majority_undoes_repetition(factor, rows, columns, seed):
    cells = np.random.default_rng(seed).integers(0, 2, (2, rows, columns), dtype=np.uint8)

    repeated = repeat_cells(cells, factor)

    assert repeated.shape == (2, rows * factor, columns * factor)
    np.testing.assert_array_equal(majority(repeated, factor), cells)
