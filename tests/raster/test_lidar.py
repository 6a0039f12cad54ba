import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ogmkit.errors import DataFileError, FrameFileError
from ogmkit.frames import FrameRecord, LidarRecord
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.raster import lidar
from ogmkit.raster.lidar import lidar_points_level, moved_points, read_points

_NORTH = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]


@pytest.fixture
def frame(tmp_path, boxes_of):
    """The ego has driven 1 m north since the sweep; the LiDAR sits 2 m up and looks to the right."""
    return FrameRecord(
        dataroot=tmp_path,
        scene_name="scene",
        location="singapore-onenorth",
        map_path="maps/m.png",
        camera="CAM_FRONT",
        sample_token="the sample",
        sample_data_token="d",
        timestamp_us=50_000,
        image_path="i.jpg",
        image_size=(9, 16),
        intrinsics=np.eye(3),
        ego_from_camera=np.eye(4),
        global_from_ego=pose_matrix([500, 701, 0], _NORTH),
        boxes=boxes_of([], [], []),
        neighbour_timestamps_us=np.full(13, -1),
        neighbour_positions_global=np.full((13, 3), np.nan),
        lidar=LidarRecord("sweep.pcd.bin", 0, pose_matrix([500, 700, 2], [1, 0, 0, 0])),
    )


def _write(frame, points):
    path = Path(frame.dataroot) / frame.lidar.path
    path.write_bytes(np.asarray(points, "<f4").tobytes())
    return path


def test_points_move_through_global_to_the_camera_s_time(frame):
    _write(frame, [[3, 0, -2, 17, 4], [0, 11, 0, 255, 31]])
    points = lidar_points_level(frame)
    assert points.dtype == np.float32
    # The first is 3 m east of the sweep's origin: on the right, and 1 m behind where the ego is by now.
    np.testing.assert_allclose(points, [[-1, -3, 0, 17], [10, 0, 2, 255]], atol=1e-5)


def test_points_that_are_not_finite_are_left_out(frame):
    _write(frame, [[1, 2, 3, 4, 0], [np.nan, 0, 0, 0, 0], [0, 0, np.inf, 0, 0]])
    assert len(lidar_points_level(frame)) == 1


@pytest.mark.parametrize("size", [0, 19, 39])
def test_a_file_that_is_empty_or_cut_short_is_named(frame, size):
    path = _write(frame, np.zeros((4, 5)))
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(DataFileError, match=r"sweep.pcd.bin.*the sample.*without --lidar"):
        lidar_points_level(frame)


def test_an_absent_file_is_named(frame):
    with pytest.raises(DataFileError, match=r"sweep.pcd.bin.*without --lidar"):
        lidar_points_level(frame)


def test_a_frame_without_a_sweep_says_so(frame):
    with pytest.raises(DataFileError, match=r"the sample.*without --lidar"):
        lidar_points_level(replace(frame, lidar=None))


def test_five_values_make_a_point_and_a_point_not_finite_in_any_of_four_is_left_out(tmp_path):
    path = tmp_path / "sweep.bin"
    values = np.arange(30, dtype="<f4").reshape(6, 5)
    for point in range(4):
        values[point, point] = (np.nan, np.inf, -np.inf, np.nan)[point]
    values[4, 4] = np.nan  # the ring counts for nothing
    path.write_bytes(values.tobytes())
    found = read_points(path, "")
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, [[20, 21, 22, 23], [25, 26, 27, 28]])


@pytest.mark.parametrize("size", [0, 1, 4, 16, 19, 21, 24, 25, 39, 41])
def test_bytes_that_are_not_whole_points_are_counted(tmp_path, size):
    path = tmp_path / "sweep.bin"
    path.write_bytes(bytes(size))
    with pytest.raises(
        FrameFileError, match=rf"sweep.bin: {size} bytes are not whole points.*; do this"
    ) as caught:
        read_points(path, "do this")
    assert caught.value.kind == "LiDAR sweep is damaged"


def test_one_point_is_enough(tmp_path):
    (tmp_path / "sweep.bin").write_bytes(np.array([1, 2, 3, 4, 5], "<f4").tobytes())
    np.testing.assert_array_equal(read_points(tmp_path / "sweep.bin", ""), [[1, 2, 3, 4]])


def test_an_absent_sweep_is_told_from_one_that_the_system_refuses(tmp_path, monkeypatch):
    with pytest.raises(
        FrameFileError, match=r"sweep.bin: can't be read \(No such file.*\); do this"
    ) as caught:
        read_points(tmp_path / "sweep.bin", "do this")
    assert caught.value.kind == "LiDAR sweep is absent"

    def refuse(path):
        raise OSError(errno.EIO, "the disk fails", str(path))

    monkeypatch.setattr(lidar, "read_bytes", refuse)
    with pytest.raises(
        DataFileError, match=r"sweep.bin: can't be read \(the disk fails\); do this"
    ) as caught:
        read_points(tmp_path / "sweep.bin", "do this")
    assert type(caught.value) is DataFileError
    assert caught.value.kind == "LiDAR sweep is unreadable"


def test_points_far_from_the_map_s_origin_keep_their_millimetres():
    turned = pose_matrix([4000.25, -3000.5, 7.0], _NORTH)
    there = pose_matrix([-3000.5 + 10, -4000.25, -7.0], [np.sqrt(0.5), 0, 0, -np.sqrt(0.5)])
    points = np.array([[1.5, -2.25, 0.75, 99]], np.float32)
    found = moved_points(there @ turned, points)
    np.testing.assert_allclose(found, [[1.5 - 3000.5 - 3000.5 + 10, -2.25 - 4000.25 - 4000.25, 0.75, 99]])
