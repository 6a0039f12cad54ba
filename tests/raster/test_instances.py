"""Instances by hand: numbers, offsets and flow of a few boxes."""

import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.raster.instances import centre_offset, instance_raster, rigid_flow

# Cell (r, c) is at x = 11.5 − r ahead, y = 3.5 − c to the left.
GRID = GridSpec(1.0, 12, 9, 12.0, 4.0)


@pytest.fixture
def two(boxes_of):
    """A car of 2 × 4 m ahead, and a van over its front that is drawn later."""
    return boxes_of([[4, 0, 1], [7, 0, 1]], [0, np.pi / 2], [[2, 4, 2], [2, 4, 2]])


def test_numbers_are_the_boxes_and_the_last_one_counts(two):
    raster = instance_raster(GRID, np.eye(4), two, np.array([7, 300]))
    assert raster.dtype == np.uint16
    picture = ["".join({0: ".", 7: "c", 300: "V"}[number] for number in row) for row in raster.tolist()]
    assert picture == [*["........."] * 4, "..VVVV...", "..VVVV...", *["...cc...."] * 4, *["........."] * 2]


def test_offsets_lead_to_the_centre(two):
    numbers = np.array([7, 300])
    raster = instance_raster(GRID, np.eye(4), two, numbers)
    offset = centre_offset(GRID, np.eye(4), two, numbers, raster)
    assert offset.dtype == np.float32
    rows, columns = np.nonzero(raster)
    points = GRID.positions_m(np.stack([columns, rows], axis=-1).astype(float))
    centres = np.where(raster[rows, columns, None] == 7, [4.0, 0.0], [7.0, 0.0])
    np.testing.assert_allclose(offset[:, rows, columns].T, centres - points, atol=1e-6)
    assert np.isnan(offset[:, raster == 0]).all()


def test_cells_move_and_turn_with_their_box(two, boxes_of):
    """The car goes 2 m on and turns left by a quarter; the van has gone."""
    raster = instance_raster(GRID, np.eye(4), two, np.array([1, 2]))
    following = boxes_of([[6, 1, 3]], [np.pi / 2], [[2, 4, 2]])
    flow = rigid_flow(GRID, np.eye(4), two, following, np.array([1, 2]), raster)
    rows, columns = np.nonzero(raster == 1)
    x, y = GRID.positions_m(np.stack([columns, rows], axis=-1).astype(float)).T
    np.testing.assert_allclose(flow[0, rows, columns], 6 - y - x, atol=1e-6)
    np.testing.assert_allclose(flow[1, rows, columns], 1 + (x - 4) - y, atol=1e-6)
    assert np.isnan(flow[:, raster != 1]).all()


def test_a_box_that_leans_moves_over_its_ground_face(boxes_of):
    """Seen from above, a box that pitches is shorter, and so are ways along it."""
    level, pitch = boxes_of([[5, 0, 1]], [0], [[2, 4, 2]]), 0.4
    turn = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    leaning = boxes_of([[5, 0, 1]], [0], [[2, 4, 2]])
    leaning.global_from_box[0, :3, :3] = turn
    raster = instance_raster(GRID, np.eye(4), level, np.array([1]))
    flow = rigid_flow(GRID, np.eye(4), level, leaning, np.array([1]), raster)
    rows, columns = np.nonzero(raster)
    x, y = GRID.positions_m(np.stack([columns, rows], axis=-1).astype(float)).T
    moved = np.stack([(x - 5) * np.cos(pitch) + 5 - np.sin(pitch), y])
    np.testing.assert_allclose(flow[:, rows, columns], moved - [x, y], atol=1e-6)


def test_without_boxes_there_is_nothing(boxes_of):
    none = boxes_of([], [], [])
    numbers = np.zeros(0, np.int64)
    raster = instance_raster(GRID, np.eye(4), none, numbers)
    assert not raster.any()
    assert np.isnan(centre_offset(GRID, np.eye(4), none, numbers, raster)).all()
    assert np.isnan(rigid_flow(GRID, np.eye(4), none, none, numbers, raster)).all()
