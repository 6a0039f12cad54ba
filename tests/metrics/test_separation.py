"""Neighbouring vehicles and the components that join them, on boxes drawn by hand."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.metrics.iou import DRIVABLE, VEHICLES
from ogmkit.metrics.separation import count_separated, neighbours
from ogmkit.raster.fill import fill_polygons

GRID = GridSpec(m_per_cell=0.5, rows=80, columns=40, ego_row=80, ego_column=24)


def car(near_m, right_m, length_m=4.0, width_m=2.0):
    """A face whose near right corner is at x, y = (near_m, right_m): 8 × 4 cells by default."""
    far, left = near_m + length_m, right_m + width_m
    return [[near_m, right_m], [far, right_m], [far, left], [near_m, left]]


def raster(*faces):
    cells = GRID.cells(np.array(faces, dtype=float).reshape(-1, 4, 2))
    return fill_polygons(cells, GRID.shape) * np.uint8(VEHICLES) | np.uint8(DRIVABLE)


def found(*faces, seen=None):
    view = np.ones(GRID.shape, np.uint8) if seen is None else seen
    return neighbours(np.array(faces, dtype=float).reshape(-1, 4, 2), GRID, raster(*faces), view)


def set_cells(code, rows, columns):
    code = code.copy()
    code[rows, columns] |= VEHICLES
    return code


ONE, TWO = car(10, 0), car(16, 0)  # 2 m behind each other: rows 52 … 59 and 40 … 47, columns 20 … 23


def test_a_grid_without_error_tells_them_apart():
    assert count_separated(found(ONE, TWO), raster(ONE, TWO)).tolist() == [1, 1, 1]


def test_vehicles_know_their_cells():
    cells = found(ONE, TWO).seen[0]
    rows, columns = np.divmod(cells, 40)

    assert len(cells) == 32
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (52, 59, 20, 23)


def test_a_bridge_joins_them():
    bridged = set_cells(raster(ONE, TWO), slice(48, 52), 21)

    assert count_separated(found(ONE, TWO), bridged).tolist() == [1, 1, 0]
    assert count_separated(found(ONE, TWO), set_cells(raster(ONE, TWO), slice(48, 51), 21)).tolist() == [
        1,
        1,
        1,
    ]


def test_cells_that_share_a_corner_are_connected():
    stairs = raster(ONE, TWO)
    for step in range(4):
        stairs[51 - step, 21 + step % 2] |= VEHICLES

    assert count_separated(found(ONE, TWO), stairs).tolist() == [1, 1, 0]


def test_drivable_cells_connect_nothing():
    assert (raster(ONE, TWO) & DRIVABLE).all()
    assert count_separated(found(ONE, TWO), raster(ONE, TWO)).tolist() == [1, 1, 1]


@pytest.mark.parametrize(("cells", "counts"), [(8, [1, 1, 1]), (7, [1, 0, 0])])
def test_a_quarter_of_its_cells_makes_a_vehicle_found(cells, counts):
    predicted = raster(TWO)
    predicted.ravel()[found(ONE, TWO).seen[0][:cells]] |= VEHICLES

    assert count_separated(found(ONE, TWO), predicted).tolist() == counts


def test_two_pieces_of_a_vehicle_are_still_apart_from_the_other():
    predicted = raster(ONE, TWO)
    predicted[55] &= ~np.uint8(VEHICLES)

    assert count_separated(found(ONE, TWO), predicted).tolist() == [1, 1, 1]


@pytest.mark.parametrize(("gap_m", "pairs"), [(10.0, 1), (10.5, 0)])
def test_neighbours_are_at_most_ten_metres_apart(gap_m, pairs):
    assert len(found(ONE, car(14 + gap_m, 0)).pairs) == pairs


@pytest.mark.parametrize(
    "other", [car(14, 0), car(12, 0), car(14, 2)], ids=["touching", "inside", "by corner"]
)
def test_what_the_truth_does_not_separate_is_no_pair(other):
    assert len(found(ONE, other).pairs) == 0


@pytest.mark.parametrize(("near_m", "pairs"), [(-2.0, 1), (-2.5, 0)])
def test_half_of_a_vehicle_must_lie_in_the_grid(near_m, pairs):
    assert len(found(car(near_m, 0), car(5, 0)).pairs) == pairs


def test_half_of_a_vehicle_must_be_in_view():
    seen = np.ones(GRID.shape, np.uint8)
    seen[56:] = 0  # rows 52 … 55 of the nearer car remain
    assert len(found(ONE, TWO, seen=seen).pairs) == 1
    seen[55, 20] = 0
    assert len(found(ONE, TWO, seen=seen).pairs) == 0


def test_vehicles_beyond_the_grid_or_too_small_for_a_cell_are_left_out():
    assert found(car(10, 0), car(60, 0)).pairs.shape == (0, 2)
    assert found(car(10, 0), car(16.1, 0.1, 0.05, 0.05)).pairs.shape == (0, 2)
    assert found().pairs.shape == (0, 2)
    assert count_separated(found(), raster(ONE)).tolist() == [0, 0, 0]


def test_three_in_a_row_make_three_pairs():
    cars = car(10, 0, 2), car(13, 0, 2), car(16, 0, 2)  # rows 56 … 59, 50 … 53, 44 … 47
    bridged = set_cells(raster(*cars), slice(48, 50), 21)

    assert found(*cars).pairs.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert count_separated(found(*cars), bridged).tolist() == [3, 3, 2]


SIDES = {  # one cell in the grid, one beyond it, and a vehicle beside
    "right": (car(10, -8.5, 4, 1), car(16, -6), (0.0, -0.5)),
    "left": (car(10, 11.5, 4, 1), car(16, 9), (0.0, 0.5)),
    "behind": (car(-0.5, 0, 1, 4), car(3, 0), (-0.5, 0.0)),
    "ahead": (car(39.5, 0, 1, 4), car(32, 0), (0.5, 0.0)),
}


@pytest.mark.parametrize(("outer", "inner", "outwards_m"), SIDES.values(), ids=SIDES)
def test_a_vehicle_on_any_side_counts_while_half_of_it_is_in_the_grid(outer, inner, outwards_m):
    assert len(found(outer, inner).pairs) == 1
    for cells in (1, 2, 12):
        beyond = (np.array(outer) + cells * np.array(outwards_m)).tolist()
        assert len(found(beyond, inner).pairs) == 0


def test_cells_of_a_turned_vehicle_are_those_of_its_face():
    face = [[10.1, 1.3], [13.4, 3.2], [12.5, 4.9], [9.2, 2.9]]
    (cells,) = found(face).seen
    np.testing.assert_array_equal(cells, np.flatnonzero(raster(face) & VEHICLES))


def test_neighbours_stay_as_they_are_and_equal_themselves_alone():
    one, two = found(ONE, TWO), found(ONE, TWO)
    with pytest.raises(FrozenInstanceError):
        one.pairs = two.pairs
    assert len({one, two}) == 2  # == of arrays is no truth value
