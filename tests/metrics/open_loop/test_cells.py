"""Collisions on cells, worked by hand."""

import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.metrics.open_loop.catalogue import STP3, UNIAD, VAD
from ogmkit.metrics.open_loop.cells import box_cells, collisions, paint, point_cells
from ogmkit.metrics.open_loop.scores import Surrounding, point_values

GRID = GridSpec()
FIELD = (UNIAD, STP3, VAD)
EMPTY = np.zeros((0, 4, 2))


def face(x, y, length=4.0, width=2.0):
    """(1, 4, 2) corners of a box along the way."""
    half = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) / 2
    return (np.array([x, y]) + half * (length, width))[None]


def by_box(definition, x, y, plan=(0.0, 0.0)):
    """Whether an ego at a plan's point hits a small obstacle at (x, y) from the lattice's origin."""
    lattice = definition.lattice
    obstacle = face(x + lattice.origin_ahead_m, y, 0.1, 0.1)
    return bool(collisions(np.array([[plan]]), [obstacle], definition.ego, lattice)[0, 0, 0])


def test_the_box_is_32_cells_that_lie_half_a_metre_ahead():
    for definition in FIELD:
        cells = box_cells(np.zeros(2), definition.ego, definition.lattice)
        assert len(np.unique(cells, axis=0)) == 32
    # (−1.542 + 49.75) / 0.5 = 96.4 to (2.542 + 49.75) / 0.5 = 104.6, and 97.65 to 101.35 across.
    for definition in (UNIAD, STP3):
        cells = box_cells(np.zeros(2), definition.ego, definition.lattice)
        assert set(cells[:, 0]) == set(range(97, 105))
        assert set(cells[:, 1]) == set(range(98, 102))
    rows = box_cells(np.zeros(2), VAD.ego, VAD.lattice)[:, 0]
    assert set(rows) == set(range(96, 104))  # 200 − 104 … 200 − 97


@pytest.mark.parametrize("definition", FIELD, ids=lambda one: one.name)
def test_an_obstacle_is_hit_from_1_5_m_behind_to_2_m_ahead(definition):
    hit = [x for x in np.arange(-3.0, 4.0, 0.5) if by_box(definition, x, 0.0)]

    assert hit == list(np.arange(-1.5, 2.1, 0.5))


def test_the_cells_lie_half_a_metre_to_one_side():
    def sides(definition):
        return [y for y in np.arange(-2.0, 2.1, 0.5) if by_box(definition, 0.0, y)]

    assert sides(UNIAD) == sides(VAD) == [-0.5, 0.0, 0.5, 1.0]  # y is left
    assert sides(STP3) == [-1.0, -0.5, 0.0, 0.5]


@pytest.mark.parametrize("definition", FIELD, ids=lambda one: one.name)
def test_the_box_moves_with_the_plan_and_never_turns(definition):
    # A turn to the left: at (10, 10) the ego would head along y, its box does along x.
    assert by_box(definition, 12.0, 10.0, plan=(10.0, 10.0))
    assert not by_box(definition, 10.0, 12.0, plan=(10.0, 10.0))


def test_a_plan_beyond_the_array_is_looked_up_at_its_border():
    # 70 m ahead there is nothing; the obstacle is in the last row.
    for definition, last_m in ((UNIAD, 49.5), (STP3, 49.5), (VAD, 50.0)):
        assert by_box(definition, last_m, 0.0, plan=(70.0, 0.0))


def test_obstacles_are_painted_with_their_outline():
    # 4 × 2 m: corners are at whole cells, so that 9 × 5 of them are painted instead of 8 × 4.
    painted = paint(face(10.0 + UNIAD.lattice.origin_ahead_m, 3.0), UNIAD.lattice)
    row, column = np.nonzero(painted)

    assert (row.min(), row.max(), column.min(), column.max()) == (116, 124, 92, 96)
    assert painted.sum() == 45
    front = paint(face(10.0 + VAD.lattice.origin_ahead_m, 3.0), VAD.lattice)
    assert set(np.nonzero(front)[0]) == set(range(76, 85))
    left = paint(face(10.0, 3.0), STP3.lattice)
    assert set(np.nonzero(left)[1]) == set(range(104, 109))


def test_several_obstacles_unite_whatever_their_layout_in_memory():
    faces = np.concatenate([face(10.0, 3.0), face(20.0, -3.0), face(11.0, 3.0)])
    found = paint(np.asfortranarray(faces), UNIAD.lattice)

    np.testing.assert_array_equal(
        found, np.maximum.reduce([paint(one[None], UNIAD.lattice) for one in faces])
    )
    assert found.sum() == 45 + 2 * 5 + 45


def test_vads_point_is_looked_up_25_m_away():
    # Of a plan's point 10 m ahead: (24.875 − 10) / 0.5 = 29.75, whose row stands for 50 − 29 · 0.5 = 35.5 m.
    ((row, column),) = point_cells(np.array([10.0, 0.0]), VAD.lattice)
    assert (50 - row * 0.5, 50 - column * 0.5) == (35.5, 25.5)  # ahead, to the left
    ((row, column),) = point_cells(np.array([10.0, 0.0]), UNIAD.lattice)
    assert (row * 0.5 - 50, 50 - column * 0.5) == (9.5, 0.5)
    ((row, column),) = point_cells(np.array([10.0, 0.0]), STP3.lattice)
    assert (row * 0.5 - 50, column * 0.5 - 50) == (9.5, -0.5)


def test_a_point_inside_a_car_collides_but_by_vads_cells():
    car = [face(10.0, 0.0)]
    points = np.array([[[10.0, 0.0]]])

    def at(definition):
        return collisions(points, car, definition.ego, definition.lattice)[1, 0, 0]

    assert (at(UNIAD), at(STP3), at(VAD)) == (1.0, 1.0, 0.0)
    elsewhere = [face(10.0 + 25.25 + 0.94, 25.25)]
    found = collisions(points, elsewhere, VAD.ego, VAD.lattice)
    assert found[:, 0, 0].tolist() == [0.0, 1.0]


def test_a_step_at_which_the_truth_collides_counts_as_none():
    ahead = face(10.0, 0.0)
    faces = [EMPTY, ahead, ahead, EMPTY, EMPTY, EMPTY]
    truth = np.column_stack([[2.0, 4.0, 10.0, 14.0, 18.0, 22.0], np.zeros(6)])
    plan = np.column_stack([[5.0, 10.0, 10.0, 15.0, 20.0, 25.0], np.zeros(6)])
    for definition in FIELD:
        around = Surrounding(truth, faces, None, GRID)
        found = point_values(definition, plan[None], around)
        assert found["collision"][0].tolist() == [0, 1, 0, 0, 0, 0]
        of_truth = point_values(definition, truth[None], around)
        assert not of_truth["collision"].any()


def test_nothing_is_known_without_a_point_or_obstacles():
    points = np.zeros((1, 6, 2))
    points[0, 5] = np.nan
    found = collisions(points, [EMPTY, None, *[EMPTY] * 4], UNIAD.ego, UNIAD.lattice)

    np.testing.assert_array_equal(found[0, 0], [0, np.nan, 0, 0, 0, np.nan])
    np.testing.assert_array_equal(found[1], found[0])
