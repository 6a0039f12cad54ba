"""Which cells are seen: by hand, and against marching along every ray."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ogmkit.frames import Boxes
from ogmkit.geometry.se3 import inverse, pose_matrix, transform_points
from ogmkit.grid import GridSpec
from ogmkit.raster.occlusion import SECTORS, reached_mask, unhidden_mask

GRID = GridSpec(1.0, 24, 17, 25.0, 7.0)
EYE = np.array([0.3, -0.2, 1.6])
LEVEL_FROM_GLOBAL = pose_matrix([-40.0, 12.0, -0.4], [np.cos(0.4), 0.0, 0.0, np.sin(0.4)])


def boxes_at(*places, size=(2.0, 4.0, 1.5)):
    """Boxes by x, y, z of the centre and heading in the level frame."""
    poses = [pose_matrix([x, y, z], [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]) for x, y, z, turn in places]
    count = len(places)
    return Boxes(
        annotation_token=tuple(map(str, range(count))),
        instance_token=tuple(map(str, range(count))),
        category=("vehicle.car",) * count,
        global_from_box=inverse(LEVEL_FROM_GLOBAL) @ np.array(poses).reshape(-1, 4, 4),
        size_wlh=np.tile(size, (count, 1)),
        visibility=np.zeros(count, np.uint8),
        num_lidar_pts=np.zeros(count, np.int64),
    )


def marched(grid, eye, boxes):
    """The same a small step at a time along each ray."""
    box_from_level = inverse(LEVEL_FROM_GLOBAL @ boxes.global_from_box)
    half = boxes.size_wlh[:, [1, 0, 2]] / 2
    steps = np.linspace(0, 1, 6001)[:, None]
    seen = np.ones(grid.shape, np.uint8)
    for row, column in np.ndindex(grid.shape):
        target = np.append(grid.positions_m(np.array([column, row])), 0.0)
        for pose, size in zip(box_from_level, half, strict=True):
            own = np.abs(transform_points(pose, target[None])[0, :2]) < size[:2]
            inside = (np.abs(transform_points(pose, eye + steps * (target - eye))) < size).all(axis=1)
            if inside.any() and not own.all():
                seen[row, column] = 0
    return seen


def test_behind_a_box_nothing_is_seen_until_the_eye_looks_over_it():
    boxes = boxes_at((8.0, 0.0, 0.6, 0.0), size=(2.0, 2.0, 1.2))
    high = np.array([0.0, 0.0, 2.4])
    mask = unhidden_mask(GRID, high, LEVEL_FROM_GLOBAL, boxes)
    ahead = mask[:, 6][::-1]  # the column at y = 0.5; x = 1.5, 2.5, …
    # The far edge of the roof, 9 m ahead and half as high as the eye, hides up to 18 m.
    assert ahead.tolist() == [1] * 7 + [1] + [0] * 9 + [1] * 7
    assert mask[:, 0].all()


@pytest.mark.parametrize("seed", [1, 2, 3])  # no ray grazes an edge by less than a step
def test_as_marching_along_each_ray(seed):
    random = np.random.default_rng(seed)
    places = np.column_stack(
        [
            random.uniform(3, 22, 5),
            random.uniform(-8, 5, 5),
            random.uniform(0, 1.5, 5),
            random.uniform(0, 6, 5),
        ]
    )
    boxes = boxes_at(*places)
    assert np.array_equal(unhidden_mask(GRID, EYE, LEVEL_FROM_GLOBAL, boxes), marched(GRID, EYE, boxes))


def traced(grid, eye, boxes):
    """The same by marching as far as no box can be: to within a nanometre, also past edges."""
    box_from_level = inverse(LEVEL_FROM_GLOBAL @ boxes.global_from_box)
    half = boxes.size_wlh[:, [1, 0, 2]] / 2
    rows, columns = np.indices(grid.shape).reshape(2, -1)
    targets = np.column_stack([grid.positions_m(np.column_stack([columns, rows])), np.zeros(len(rows))])
    length = np.linalg.norm(targets - eye, axis=1)
    seen = np.ones(len(rows), bool)
    for pose, size in zip(box_from_level, half, strict=True):
        start, end = transform_points(pose, eye[None])[0], transform_points(pose, targets)
        gone, going = np.zeros(len(rows)), np.ones(len(rows), bool)
        while going.any():
            at = start + (gone / length)[:, None] * (end - start)
            beyond = np.abs(at) - size
            free = np.linalg.norm(np.maximum(beyond, 0), axis=1)
            hit = going & (free < 1e-9) & (gone < length)
            own = (np.abs(end[:, :2]) < size[:2]).all(axis=1)
            seen[hit & ~own] = False
            gone = gone + np.where(going, np.maximum(free, 1e-9), 0)
            going &= ~hit & (gone < length)
    return seen.reshape(grid.shape)


PLACE = st.tuples(*(st.integers(*ends) for ends in ((-2, 24), (-9, 7), (-1, 3), (0, 62))))
"""Of a box's centre and heading; what is added keeps edges off the cells' centres."""


@settings(max_examples=25)
@given(st.lists(PLACE, max_size=3), st.tuples(st.integers(1, 5), st.integers(2, 9), st.integers(1, 4)))
def test_no_cell_differs_from_marching_without_steps(places, size):
    exact = np.array(places, float).reshape(-1, 4) * [1, 1, 0.6, 0.1] + [0.137, 0.219, 0.083, 0.0371]
    boxes = boxes_at(*exact, size=np.array(size) * 0.97 + 0.113)
    grid = GridSpec(1.0, 14, 9, 15.0, 4.0)
    found = unhidden_mask(grid, EYE, LEVEL_FROM_GLOBAL, boxes)
    np.testing.assert_array_equal(found, traced(grid, EYE, boxes))


def test_only_what_is_in_view_is_asked_for_and_nothing_hides_without_boxes():
    view = np.zeros(GRID.shape, np.uint8)
    view[3:9, 4:7] = 1
    assert np.array_equal(unhidden_mask(GRID, EYE, LEVEL_FROM_GLOBAL, boxes_at(), view), view)
    assert unhidden_mask(GRID, EYE, LEVEL_FROM_GLOBAL, boxes_at()).all()


def test_beams_reach_to_the_farthest_point_of_their_sector():
    points = np.array([[5.3, -0.2 + 1e-6, 0.1, 7.0], [10.8, -0.2 + 1e-6, 0.1, 7.0]])
    mask = reached_mask(GRID, EYE, points)
    width = 2 * np.pi / SECTORS
    for row, column in np.ndindex(GRID.shape):
        x, y = GRID.positions_m(np.array([column, row])) - EYE[:2]
        assert mask[row, column] == (0 <= np.arctan2(y, x) < width and np.hypot(x, y) <= 10.5)


def test_a_ring_of_points_is_seen_to_its_radius():
    turn = np.linspace(-np.pi, np.pi, 4 * SECTORS, endpoint=False) + 1e-4
    ring = EYE[:2] + 12.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    mask = reached_mask(GRID, EYE, np.column_stack([ring, np.zeros(len(ring))]))
    rows, columns = np.indices(GRID.shape)
    positions = GRID.positions_m(np.stack([columns, rows], axis=-1)) - EYE[:2]
    assert np.array_equal(mask, np.hypot(*np.moveaxis(positions, -1, 0)) <= 12.0)
