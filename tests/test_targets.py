from dataclasses import replace

import cv2
import numpy as np
import pytest

from ogmkit.errors import DataFileError, SettingsError, TableError
from ogmkit.frames import Boxes, FrameRecord, LidarRecord
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.target_settings import TargetSettings
from ogmkit.targets import build_targets, frame_targets, read_image

_GRID = GridSpec(m_per_cell=0.5, rows=40, columns=30, ego_row=36, ego_column=12)
_CAMERA_AHEAD = np.array([[0, 0, 1, 1.5], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]], dtype=float)
_INTRINSICS = np.array([[30.0, 0, 19.5], [0, 30.0, 11.5], [0, 0, 1]])


@pytest.fixture
def frame(tmp_path):
    """The ego at (30, 20) facing east, driving 5 m a step; a car 10 m ahead, a pedestrian 5 m ahead."""
    dataroot = tmp_path / "dataroot"
    dataroot.mkdir()
    _write_jpeg(dataroot / "image.jpg", (24, 40))
    # Drivable south of y = 22 only: on the raster, from 2 m left of the ego rightwards.
    cv2.imwrite(
        str(dataroot / "mask.png"), np.repeat(np.array([[0], [255]], np.uint8), [180, 220], 0).repeat(600, 1)
    )
    np.array([[10, 0, 1, 9, 0]], "<f4").tofile(dataroot / "sweep.pcd.bin")
    steps = np.arange(-6, 7)
    here = pose_matrix([30, 20, 0], [1, 0, 0, 0])
    return FrameRecord(
        dataroot=dataroot,
        scene_name="scene",
        location="boston-seaport",
        map_path="mask.png",
        camera="CAM_FRONT",
        sample_token="the sample",
        sample_data_token="the sample data",
        timestamp_us=3_000_000,
        image_path="image.jpg",
        image_size=(24, 40),
        intrinsics=_INTRINSICS,
        ego_from_camera=_CAMERA_AHEAD,
        global_from_ego=here,
        boxes=Boxes(
            annotation_token=("a", "b"),
            instance_token=("i", "j"),
            category=("vehicle.car", "human.pedestrian.adult"),
            global_from_box=pose_matrix([[40, 20, 1], [35, 20, 1]], [[1, 0, 0, 0]] * 2),
            size_wlh=np.array([[2.0, 4.0, 1.5], [1.0, 1.0, 1.8]]),
            visibility=np.array([1, 4], np.uint8),
            num_lidar_pts=np.array([3, 1]),
        ),
        neighbour_timestamps_us=3_000_000 + 500_000 * steps,
        neighbour_positions_global=np.stack([30 + 5.0 * steps, 20.0 + 0 * steps, 0.0 * steps], axis=1),
        lidar=LidarRecord("sweep.pcd.bin", 3_035_000, here),
    )


@pytest.fixture
def build(tmp_path):
    def build(frame, **settings):
        mask = MaskStore(tmp_path / "cache").open(frame.dataroot / frame.map_path)
        return build_targets(frame, TargetSettings(grid=_GRID, **settings), mask)

    return build


def _write_jpeg(path, shape):
    picture = np.random.default_rng(0).integers(0, 255, (*shape, 3), dtype=np.uint8)
    cv2.imwrite(str(path), picture)


def test_all_targets_of_a_frame_share_the_grid_and_lie_where_the_scene_says(frame, build):
    targets = build(frame)
    # Cell (r, c): x from 0.5·(35 − r), y from 0.5·(11 − c) in metres.
    drivable = np.zeros(_GRID.shape, np.uint8)
    drivable[:, 8:] = 1
    np.testing.assert_array_equal(targets.drivable, drivable)
    vehicles = np.zeros(_GRID.shape, np.uint8)
    vehicles[36 - 24 : 36 - 16, 12 - 2 : 12 + 2] = 1
    np.testing.assert_array_equal(targets.vehicles, vehicles)
    assert targets.field_of_view[0, 12]
    assert not targets.field_of_view[34:].any()
    np.testing.assert_allclose(targets.trajectory.future[:, 0], [5, 10, 15, 20, 25, 30])
    assert {mask.dtype for mask in (targets.drivable, targets.vehicles, targets.field_of_view)} == {
        np.dtype("u1")
    }


def test_settings_choose_boxes_gap_and_lidar(frame, build):
    assert not build(frame, min_visibility=2).vehicles.any()
    assert build(frame, min_lidar_points=3).vehicles.any()
    assert not build(frame, min_lidar_points=4).vehicles.any()
    assert build(frame, categories=("human.",)).vehicles.sum() == 4
    assert not build(frame, max_gap_s=0.4).trajectory.valid
    assert build(frame).lidar_points is None
    np.testing.assert_allclose(build(frame, lidar=True).lidar_points, [[10, 0, 1, 9]])


def test_images_are_kept_checked_or_left_alone(frame, build):
    original = (frame.dataroot / "image.jpg").read_bytes()
    assert build(frame).image == original
    assert build(frame, images="reference").image is None
    (frame.dataroot / "image.jpg").unlink()
    assert build(frame, images="none").image is None
    for images in ("bytes", "reference"):
        with pytest.raises(DataFileError, match=r"image\.jpg.*No such file.*--images none"):
            build(frame, images=images)


@pytest.mark.parametrize("content", [b"", b"<html></html>", b"\x89PNG\r\n\x1a\n", None])
def test_an_image_that_is_no_whole_jpeg_is_named_with_its_record_and_the_remedy(frame, content):
    path = frame.dataroot / "image.jpg"
    path.write_bytes(path.read_bytes()[:-200] if content is None else content)
    with pytest.raises(DataFileError, match=r"image\.jpg: .*the sample data .*JPEG.*--images none$"):
        read_image(frame)


def test_a_png_is_kept_byte_by_byte(frame, build):
    height, width = frame.image_size
    done, data = cv2.imencode(".png", np.full((height, width, 3), 77, np.uint8))
    assert done
    (frame.dataroot / "image.jpg").write_bytes(data.tobytes())

    assert build(frame).image == data.tobytes()


def test_an_image_of_another_size_than_the_table_s_is_refused(frame):
    _write_jpeg(frame.dataroot / "image.jpg", (40, 24))
    with pytest.raises(DataFileError, match=r"is 24 × 40 pixels, by its table 40 × 24.*--images none"):
        read_image(frame)


def test_an_image_outside_the_dataset_is_never_read(frame):
    _write_jpeg(frame.dataroot.parent / "outside.jpg", (24, 40))
    with pytest.raises(TableError, match=r"outside\.jpg"):
        read_image(replace(frame, image_path="../outside.jpg"))


def test_a_folder_in_the_image_s_place_is_an_error_of_the_same_kind(frame):
    with pytest.raises(DataFileError, match="--images none"):
        read_image(replace(frame, image_path="."))


@pytest.mark.parametrize(
    "wrong",
    [
        {"categories": ()},
        {"categories": ("vehicle.", "")},
        {"min_visibility": 5},
        {"min_visibility": -1},
        {"min_lidar_points": -1},
        {"max_gap_s": 0.0},
        {"max_gap_s": float("nan")},
        {"max_gap_s": float("inf")},
        {"images": "all"},
    ],
)
def test_impossible_settings_are_refused_by_name(wrong):
    (name,) = wrong
    with pytest.raises(SettingsError, match=name):
        TargetSettings(**wrong)


def test_a_real_image_passes(real_dataroot, frame):
    (image,) = (real_dataroot / "samples" / "CAM_FRONT").glob("*.jpg")
    path = str(image.relative_to(real_dataroot))
    assert read_image(replace(frame, dataroot=real_dataroot, image_path=path, image_size=(900, 1600)))


def test_a_frame_s_targets_in_one_call(frame, build, tmp_path):
    expected = build(frame)

    found = frame_targets(frame, TargetSettings(grid=_GRID), cache_dir=tmp_path / "other")

    for name in ("drivable", "vehicles", "field_of_view"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert (found.image, found.trajectory.valid) == (expected.image, True)
    assert len(list((tmp_path / "other").glob("*.mask"))) == 1
    assert frame_targets(frame, cache_dir=tmp_path / "other").drivable.shape == (1000, 550)


def test_a_map_that_is_absent_is_named(frame, tmp_path):
    with pytest.raises(DataFileError, match=r"elsewhere\.png: map mask can't be read"):
        frame_targets(replace(frame, map_path="elsewhere.png"), cache_dir=tmp_path)
