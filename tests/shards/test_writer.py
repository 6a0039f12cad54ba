import hashlib
from dataclasses import replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import DataFileError, TableError
from ogmkit.shards import schema
from ogmkit.shards.fields import parts_of
from ogmkit.shards.reader import Shard
from ogmkit.shards.structure import structure_problems
from ogmkit.shards.writer import write_shard
from ogmkit.target_settings import TargetSettings
from ogmkit.targets import build_targets

CAMERAS = ("CAM_BACK", "CAM_FRONT")


@pytest.fixture(scope="module")
def path(tmp_path_factory, scene, small_settings, masks):
    path = tmp_path_factory.mktemp("out") / "scene-0007.h5"
    write_shard(path, scene, small_settings, masks, dataset_version="v1.0-mini")
    return path


@pytest.fixture(scope="module")
def shard(path):
    with Shard(path) as shard:
        yield shard


@pytest.fixture(scope="module")
def targets(scene, small_settings, masks):
    """Camera → each frame's targets, made here again."""
    mask = masks.open(scene.cameras["CAM_FRONT"][0].dataroot / "maps/map.png")
    return {
        camera: [build_targets(frame, small_settings, mask) for frame in frames]
        for camera, frames in scene.cameras.items()
    }


def test_the_attributes_tell_where_it_comes_from(shard, small_settings):
    assert (shard.scene, shard.location, shard.dataset_version) == (
        "scene-0007",
        "boston-seaport",
        "v1.0-mini",
    )
    assert shard.cameras == CAMERAS
    assert shard.settings.targets == small_settings
    assert shard.h5.attrs["grid_ego_column"] == 13.0


def test_the_log_is_kept_where_it_is_known(tmp_path, shard, scene, small_settings, masks):
    assert (shard.log, "log" in shard.h5.attrs) == ("", False)
    known = replace(scene, log="0123abcd")
    write_shard(tmp_path / "scene-0007.h5", known, small_settings, masks, dataset_version="v1.0-mini")
    with Shard(tmp_path / "scene-0007.h5") as written:
        assert written.log == "0123abcd"
        assert list(structure_problems(written)) == []


def test_it_follows_the_schema(shard):
    assert list(structure_problems(shard)) == []


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize(
    "name",
    [
        "timestamp_us",
        "image_size",
        "intrinsics",
        "ego_from_camera",
        "global_from_ego",
        "level_from_global",
    ],
)
def test_numbers_of_the_frames_come_back(shard, scene, camera, name):
    expected = np.array([getattr(frame, name) for frame in scene.cameras[camera]])
    np.testing.assert_array_equal(shard.dataset(camera, name)[:], expected)


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("name", ["sample_token", "sample_data_token", "image_path"])
def test_texts_of_the_frames_come_back(shard, scene, camera, name):
    expected = tuple(getattr(frame, name) for frame in scene.cameras[camera])
    assert shard.strings(camera, name) == expected


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("name", ["drivable", "vehicles", "field_of_view"])
def test_rasters_come_back(shard, targets, camera, name):
    expected = np.array([getattr(frame, name) for frame in targets[camera]])
    assert 0 < expected.mean() < 1
    np.testing.assert_array_equal(shard.dataset(camera, name)[:], expected)


@pytest.mark.parametrize("name", ["past", "past_valid", "future", "future_valid", "valid"])
def test_trajectories_come_back(shard, targets, name):
    expected = np.array([getattr(frame.trajectory, name) for frame in targets["CAM_BACK"]])
    np.testing.assert_array_equal(shard.dataset("CAM_BACK", f"trajectory/{name}")[:], expected)


def test_images_come_back_byte_by_byte(shard, scene):
    for index, frame in enumerate(scene.cameras["CAM_BACK"]):
        original = (frame.dataroot / frame.image_path).read_bytes()
        assert shard.image("CAM_BACK", index).tobytes() == original


def test_boxes_come_back(shard, scene):
    for index, frame in enumerate(scene.cameras["CAM_FRONT"]):
        found = shard.boxes("CAM_FRONT", index)
        assert found.annotation_token == frame.boxes.annotation_token
        assert found.instance_token == frame.boxes.instance_token
        assert found.category == frame.boxes.category
        for name in ("global_from_box", "size_wlh", "visibility", "num_lidar_pts"):
            np.testing.assert_array_equal(getattr(found, name), getattr(frame.boxes, name))


def test_lidar_points_come_back(shard, targets):
    offsets = shard.dataset("CAM_FRONT", "lidar/offsets")[:]
    points = shard.dataset("CAM_FRONT", "lidar/points")
    assert offsets.tolist() == [0, 20, 41, 63, 86, 110]
    for index, frame in enumerate(targets["CAM_FRONT"]):
        np.testing.assert_array_equal(points[offsets[index] : offsets[index + 1]], frame.lidar_points)


def test_shares_are_those_of_the_rasters(shard):
    for name, share in (("drivable", "drivable_share"), ("vehicles", "vehicle_share")):
        raster = shard.dataset("CAM_FRONT", name)[:]
        assert shard.h5["CAM_FRONT"].attrs[share] == pytest.approx(raster.mean(), rel=1e-12)


def test_six_lines_of_plain_h5py(path):
    with h5py.File(path, locking=False) as file:  # as the shard that this module's tests hold open
        front = file["CAM_FRONT"]
        drivable = front["drivable"][2]
        first, stop = front["boxes/offsets"][2:4]
        categories = front["boxes/category"].asstr()[first:stop]
        jpeg = front["image"][2].tobytes()
    assert drivable.shape == (60, 40)
    assert list(categories) == ["vehicle.car", "human.pedestrian.adult"]
    assert jpeg.startswith(b"\xff\xd8")


def test_every_dataset_carries_its_meaning(path, small_settings):
    with h5py.File(path, locking=False) as file:
        for field in schema.fields(parts_of(small_settings)):
            attributes = file["CAM_FRONT"][field.name].attrs
            assert attributes["description"] == field.description
            assert (attributes["units"], attributes["frame"]) == (field.units, field.frame)


def test_the_same_scene_gives_the_same_bytes(tmp_path, path, scene, small_settings, masks):
    write_shard(tmp_path / "again.h5", scene, small_settings, masks, dataset_version="v1.0-mini")
    digests = [hashlib.sha256(file.read_bytes()).digest() for file in (path, tmp_path / "again.h5")]
    assert digests[0] == digests[1]


@pytest.mark.parametrize("compression", ["lzf", "none"])
def test_compression_changes_nothing_but_the_size(tmp_path, shard, scene, small_settings, masks, compression):
    path = tmp_path / "other.h5"
    write_shard(path, scene, small_settings, masks, dataset_version="v", compression=compression)
    with Shard(path) as other:
        expected = None if compression == "none" else compression
        assert other.h5["CAM_FRONT/drivable"].compression == expected
        for name in ("drivable", "vehicles", "field_of_view", "lidar/points"):
            found, same = (each.dataset("CAM_FRONT", name)[:] for each in (other, shard))
            np.testing.assert_array_equal(found, same)


def test_images_and_points_are_left_out_unless_asked_for(tmp_path, scene, small_grid, masks):
    path = tmp_path / "scene-0007.h5"
    write_shard(path, scene, TargetSettings(small_grid, images="none"), masks, dataset_version="v")
    with Shard(path) as shard:
        assert "lidar" not in shard.h5["CAM_FRONT"]
        assert shard.image("CAM_FRONT", 0) is None
        assert list(structure_problems(shard)) == []


def test_a_scene_without_any_box(tmp_path, scene, small_settings, masks):
    first = {camera: frames[:1] for camera, frames in scene.cameras.items()}
    write_shard(tmp_path / "a.h5", replace(scene, cameras=first), small_settings, masks, dataset_version="v")
    with Shard(tmp_path / "a.h5") as shard:
        assert len(shard.boxes("CAM_FRONT", 0)) == 0
        assert shard.dataset("CAM_FRONT", "boxes/global_from_box").shape == (0, 4, 4)


def test_a_missing_image_leaves_nothing_behind(tmp_path, broken_scene, small_settings, masks):
    with pytest.raises(DataFileError, match=r"absent\.jpg.*--images none"):
        write_shard(tmp_path / "a.h5", broken_scene, small_settings, masks, dataset_version="v")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_image_leaves_the_old_shard(tmp_path, broken_scene, small_settings, masks):
    (tmp_path / "a.h5").write_bytes(b"old")
    with pytest.raises(DataFileError):
        write_shard(tmp_path / "a.h5", broken_scene, small_settings, masks, dataset_version="v")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"old"]


def test_a_camera_without_frames_is_refused(tmp_path, scene, small_settings, masks):
    empty = replace(scene, cameras={"CAM_FRONT": ()})
    with pytest.raises(TableError, match="scene-0007: has no key frames of CAM_FRONT"):
        write_shard(tmp_path / "a.h5", empty, small_settings, masks, dataset_version="v")
