"""Reading frames for drawing."""

import dataclasses

import h5py
import numpy as np
import pytest

from ogmkit.errors import DataFileError, TableError
from ogmkit.pictures.views import evenly, read_view
from ogmkit.shards.reader import Shard


@pytest.mark.parametrize(
    ("count", "of", "expected"),
    [
        (6, 40, (3, 10, 16, 23, 30, 36)),
        (2, 40, (10, 30)),
        (1, 40, (20,)),
        (6, 3, (0, 1, 2)),
        (3, 3, (0, 1, 2)),
        (1, 1, (0,)),
        (6, 0, ()),
    ],
)
def test_frames_are_the_middles_of_equal_parts(count, of, expected):
    assert evenly(count, of) == expected


def test_a_view_holds_the_frame_with_boxes_in_the_camera_frame(make_shards):
    with Shard(make_shards() / "scene-0001.h5") as shard:
        view = read_view(shard, "CAM_FRONT", 2)

    assert (view.index, view.time_s, view.image_size) == (2, 1.0, (90, 160))
    # The car at (12, 3, 0.8) in the ego frame, the camera at (1.5, 0, 1.5): x right, y down, z forward.
    assert view.category[0] == "vehicle.car"
    np.testing.assert_allclose(view.camera_from_box[0, :3, 3], [-3.0, 0.7, 10.5], atol=1e-9)
    np.testing.assert_allclose(view.camera_from_box[0, :3, 0], [0, 0, 1], atol=1e-9)
    assert abs(view.image[45, 80].astype(int) - (30, 90, 200)).max() < 6


def replace_image(path, data):
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/image"][1] = np.frombuffer(data, np.uint8)


@pytest.mark.parametrize("damage", ["cut", "size", "empty", "html"])
def test_a_damaged_image_is_named(make_shards, jpeg, damage):
    path = make_shards() / "scene-0001.h5"
    whole = jpeg()
    data = {"cut": whole[: len(whole) // 2], "size": jpeg((80, 160)), "empty": b"", "html": b"<html></html>"}
    replace_image(path, data[damage])

    with Shard(path) as shard, pytest.raises(DataFileError, match=r"scene-0001.h5: CAM_FRONT/image\[1\]"):
        read_view(shard, "CAM_FRONT", 1)


def test_images_that_the_shard_only_refers_to_come_from_the_dataset(make_shards, jpeg, tmp_path):
    folder = tmp_path / "dataset" / "samples" / "CAM_FRONT"
    folder.mkdir(parents=True)
    (folder / "scene-0001-0.jpg").write_bytes(jpeg())
    with Shard(make_shards(images="reference") / "scene-0001.h5") as shard:
        assert read_view(shard, "CAM_FRONT", 0).image is None
        view = read_view(shard, "CAM_FRONT", 0, dataroot=tmp_path / "dataset")
        assert view.image.shape == (90, 160, 3)
        with pytest.raises(DataFileError, match=r"scene-0001-1.jpg: No such file.*--dataroot"):
            read_view(shard, "CAM_FRONT", 1, dataroot=tmp_path / "dataset")


def test_an_image_path_that_leaves_the_dataset_is_refused(make_shards, jpeg, tmp_path):
    (tmp_path / "outside.jpg").write_bytes(jpeg())
    path = make_shards(images="reference") / "scene-0001.h5"
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/image_path"][0] = "../outside.jpg"

    with Shard(path) as shard, pytest.raises(TableError, match=r"outside\.jpg"):
        read_view(shard, "CAM_FRONT", 0, dataroot=tmp_path / "dataset")


def test_views_are_frozen(make_shards):
    with Shard(make_shards() / "scene-0001.h5") as shard:
        view = read_view(shard, "CAM_FRONT", 0)

    with pytest.raises(dataclasses.FrozenInstanceError):
        view.index = 1
