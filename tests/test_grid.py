from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec, default_ego

_grids = st.builds(
    GridSpec,
    m_per_cell=st.floats(0.01, 5),
    rows=st.integers(1, 2000),
    columns=st.integers(1, 2000),
    ego_row=st.floats(-500, 2500),
    ego_column=st.floats(-500, 2500),
)


def test_the_default_is_the_paper_s_and_covers_100_by_55_m():
    grid = GridSpec()
    assert grid.shape == (1000, 550)
    assert grid.x_range_m == pytest.approx((0, 100))
    assert grid.y_range_m == pytest.approx((-25, 30))


def test_the_ego_stands_on_the_bottom_edge_30_m_from_the_left_one():
    np.testing.assert_allclose(GridSpec().cells(np.zeros(3)), [299.5, 999.5])


def test_a_cell_covers_the_metres_that_the_design_says():
    # Row r covers x from 0.1·(999 − r) to 0.1·(1000 − r); its centre is in the middle.
    np.testing.assert_allclose(GridSpec().positions_m(np.array([0.0, 0.0])), [99.95, 29.95])
    np.testing.assert_allclose(GridSpec().positions_m(np.array([549.0, 999.0])), [0.05, -24.95])


def test_forward_is_up_and_left_is_left_on_an_off_centre_grid_of_quarter_metres():
    grid = GridSpec(m_per_cell=0.25, rows=80, columns=40, ego_row=60, ego_column=10)
    points = np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 2.0], [-5.0, -7.5]])
    np.testing.assert_allclose(grid.cells(points), [[9.5, 59.5], [9.5, 39.5], [1.5, 59.5], [39.5, 79.5]])
    assert grid.x_range_m == pytest.approx((-5, 15))
    assert grid.y_range_m == pytest.approx((-7.5, 2.5))


@given(_grids, st.floats(-500, 500), st.floats(-500, 500))
def test_cells_and_positions_undo_each_other(grid, x, y):
    np.testing.assert_allclose(grid.positions_m(grid.cells(np.array([x, y]))), [x, y], atol=1e-7)
    np.testing.assert_allclose(grid.bev_from_level @ grid.level_from_bev, np.eye(3), atol=1e-7)


@given(_grids)
def test_the_ranges_are_the_outer_edges_of_the_outer_cells(grid):
    first = grid.positions_m(np.array([-0.5, -0.5]))
    last = grid.positions_m(np.array([grid.columns - 0.5, grid.rows - 0.5]))
    np.testing.assert_allclose([first[0], last[0]], grid.x_range_m[::-1], atol=1e-7)
    np.testing.assert_allclose([first[1], last[1]], grid.y_range_m[::-1], atol=1e-7)


@pytest.mark.parametrize(
    "wrong",
    [
        {"m_per_cell": 0.0},
        {"m_per_cell": -0.1},
        {"m_per_cell": float("nan")},
        {"m_per_cell": float("inf")},
        {"m_per_cell": 1e-320},  # its inverse is infinite
        {"m_per_cell": 1e300},
        {"rows": 0},
        {"columns": -1},
        {"rows": 1 << 15, "columns": 1 << 14},
        {"ego_row": float("nan")},
        {"ego_column": float("inf")},
        {"ego_row": -1e300},
    ],
)
def test_impossible_grids_are_refused(wrong):
    with pytest.raises(SettingsError, match=r"^(grid|m_per_cell|rows|columns|ego_row|ego_column): "):
        GridSpec(**wrong)


@pytest.mark.parametrize(
    "allowed",
    [
        {"m_per_cell": 1e-6},
        {"m_per_cell": 1e6},
        {"rows": 1, "columns": 1},
        {"rows": 1 << 15, "columns": 1 << 13},
        {"ego_row": -1e9, "ego_column": 1e9},
        {"ego_row": 1e9, "ego_column": -1e9},
    ],
)
def test_the_limits_themselves_are_allowed(allowed):
    grid = GridSpec(**allowed)
    assert {name: getattr(grid, name) for name in allowed} == allowed


@pytest.mark.parametrize(
    "wrong",
    [
        {"m_per_cell": 0.99e-6},
        {"m_per_cell": 1.01e6},
        {"rows": (1 << 15) + 1, "columns": 1 << 13},
        {"ego_row": 1e9 + 0.5},
        {"ego_column": -1e9 - 0.5},
    ],
)
def test_what_is_just_beyond_a_limit_is_refused(wrong):
    with pytest.raises(SettingsError):
        GridSpec(**wrong)


@pytest.mark.parametrize(
    ("rows", "columns", "ego"), [(1000, 550, (1000.0, 300.0)), (70, 33, (70.0, 18.0)), (9, 1, (9.0, 6 / 11))]
)
def test_where_nothing_is_said_the_ego_stands_on_the_bottom_edge_at_six_elevenths(rows, columns, ego):
    assert default_ego(rows, columns) == ego
    assert isinstance(default_ego(rows, columns)[0], float)


def test_a_grid_is_a_value_that_stays():
    grid = GridSpec(0.25, 80, 40, 60.0, 10.0)
    with pytest.raises(FrozenInstanceError):
        grid.rows = 81
    assert grid == GridSpec(0.25, 80, 40, 60.0, 10.0) != GridSpec(0.25, 80, 41, 60.0, 10.0)
