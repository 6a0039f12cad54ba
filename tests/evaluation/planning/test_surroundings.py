"""Points on cells and in vehicles: an off-centre grid, turned boxes, and the right frame of each point."""

import json
import re

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.errors import ShardError
from ogmkit.evaluation.planning.sequences import sequences_of
from ogmkit.evaluation.planning.surroundings import in_vehicle, off_drivable, surrounding_values
from ogmkit.grid import GridSpec

SMALL = GridSpec(m_per_cell=2.0, rows=3, columns=4, ego_row=2, ego_column=1)
"""x from −2 to 4 m, y from −6 to 2 m."""


def values_of(shards, points):
    sequences = sequences_of(shards, split="val", split_file=None, cameras=(), limit=None)
    rows = points(sequences.truth)
    ticks = []
    found = surrounding_values(sequences, rows, lambda: ticks.append(1))
    assert len(ticks) == len(sequences)
    return found


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.1, 0.1), 1),  # row 1, column 0
        ((1.9, -0.1), 0),  # row 1, column 1
        ((2.1, -5.9), 1),  # row 0, column 3
        ((-1.9, -3.9), 1),  # row 2, column 2
        ((-0.1, -0.1), 1),  # row 2, column 1
        ((4.1, 0.0), np.nan),
        ((-2.1, 0.0), np.nan),
        ((0.0, 2.1), np.nan),
        ((0.0, -6.1), np.nan),
        ((1e12, 0.0), np.nan),
    ],
)
def test_cells_of_points(point, expected):
    drivable = np.zeros(SMALL.shape, np.uint8)
    drivable[1, 1] = 1

    np.testing.assert_equal(off_drivable(np.array([[point]]), drivable, SMALL), [[expected]])


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3.1, 3.1), st.floats(0.2, 4), st.floats(0.2, 4))
def test_a_turned_rectangle_holds_what_it_holds_in_its_own_frame(x, y, yaw, width, length):
    half = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * [length / 2, width / 2]
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    centre = np.array([0.7, -0.4])
    along, across = turn.T @ ([x, y] - centre)
    if min(abs(abs(along) - length / 2), abs(abs(across) - width / 2)) < 1e-9:
        return  # on the edge

    found = in_vehicle(np.array([[[x, y]]]), ((half @ turn.T + centre)[None],))
    assert found[0, 0] == (abs(along) < length / 2 and abs(across) < width / 2)


def test_any_face_of_the_points_own_step_counts():
    square = np.array([[1.0, 1], [1, -1], [-1, -1], [-1, 1]])
    faces = (np.stack([square + 10, square]), np.zeros((0, 4, 2)), square[None] + 5)
    points = np.array([[[0.0, 0.0]] * 3, [[10.0, 10.5], [10, 10], [5.5, 5]]])

    np.testing.assert_array_equal(in_vehicle(points, faces), [[1, 0, 0], [1, 0, 1]])


def test_off_drivable_of_the_last_frame(shards):
    # Columns 0 … 9 are not drivable: y from 7 to 12 m.
    with h5py.File(shards / "scene-0002.h5", "r+") as h5:
        h5["CAM_FRONT/drivable"][9:] = 0  # later frames don't matter
    found = values_of(shards, lambda truth: np.stack([truth, truth * 0 + [1.0, 7.3], truth * 0 + [1.0, 6.8]]))

    np.testing.assert_array_equal(found[0, :, :3].mean(axis=(1, 2)), [0, 1, 0])
    np.testing.assert_array_equal(found[1], 0)


def test_a_vehicle_counts_where_it_is_when_the_ego_would_be_there(shards, put_boxes):
    path = shards / "scene-0002.h5"
    with h5py.File(path) as h5:
        place = h5["CAM_FRONT/global_from_ego"][9, :2, 3]
    put_boxes(path, 9, {"vehicle.car": (*place, 1.0)})
    found = values_of(shards, lambda truth: np.stack([truth, truth + np.array([0, 3.0])]))[1]

    # Frame 9 lies 3, 2 and 1 steps after the sequences that end at 6, 7 and 8.
    expected = np.zeros((6, 5))
    expected[[0, 1, 2], [2, 1, 0]] = 1
    np.testing.assert_array_equal(found[0], expected)
    np.testing.assert_array_equal(found[1], 0)


def test_only_what_counts_as_a_vehicle_in_the_shards(shards, put_boxes):
    path = shards / "scene-0002.h5"
    with h5py.File(path) as h5:
        place = h5["CAM_FRONT/global_from_ego"][9, :2, 3]
    put_boxes(path, 9, {"human.pedestrian.adult": (*place, 0.0)})

    assert not values_of(shards, lambda truth: truth[None])[1].any()


def test_a_box_without_a_pose_is_named(shards, put_boxes):
    put_boxes(shards / "scene-0003.h5", 9, {"vehicle.car": (np.nan, 0.0, 0.0)})

    message = "scene-0003.h5: CAM_FRONT: frame 9 has a box whose pose or size is not finite"
    with pytest.raises(ShardError, match=re.escape(message)):
        values_of(shards, lambda truth: truth[None])


def _leave_out(path, frame):
    """Take a frame without boxes out of a shard, as an extraction does whose file is absent."""
    with h5py.File(path, "r+") as h5:
        front = h5["CAM_FRONT"]
        time_us, names = front["timestamp_us"][frame], []
        front.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        for name in names:
            values = front[name][:]
            if len(values) >= 15:
                del front[name]
                front[name] = np.delete(values, frame, axis=0)
        front["left_out/timestamp_us"] = [time_us]
        front["left_out/sample_data_token"] = ["lost"]


def test_of_a_frame_that_is_left_out_nothing_is_known(shards):
    """Frame 9 lies 3, 2 and 1 steps after the sequences that end at 6, 7 and 8: none needs its image."""
    _leave_out(shards / "scene-0002.h5", 9)
    off, inside = values_of(shards, lambda truth: truth[None])

    expected = np.zeros((6, 5))
    expected[[0, 1, 2], [2, 1, 0]] = np.nan
    np.testing.assert_array_equal(inside[0], expected)
    assert not np.isnan(off).any()


def test_without_maps_nothing_is_known_of_the_drivable_area(shards):
    for path in shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            del h5["CAM_FRONT/drivable"]
            h5.attrs["settings"] = json.dumps(json.loads(h5.attrs["settings"]) | {"no_map": True})
    off, inside = values_of(shards, lambda truth: truth[None])

    assert np.isnan(off).all()
    assert not inside.any()
