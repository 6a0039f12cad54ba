"""Records against an independent derivation: plain json, dictionaries and pyquaternion."""

import errno
import json
import os
import pickle
import re

import numpy as np
import pytest
from pyquaternion import Quaternion

from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.dataset import Dataset


class Reference:
    """All tables by token, read with `json`."""

    def __init__(self, root):
        (folder,) = root.glob("v1.0-*")
        self.rows = {path.stem: json.loads(path.read_text()) for path in folder.glob("*.json")}
        self.by_token = {name: {row["token"]: row for row in rows} for name, rows in self.rows.items()}

    def get(self, table, token):
        return self.by_token[table][token]

    def samples(self, scene_name):
        (scene,) = (scene for scene in self.rows["scene"] if scene["name"] == scene_name)
        token = scene["first_sample_token"]
        while token:
            sample = self.get("sample", token)
            yield sample
            token = sample["next"]

    def data(self, sample_token, channel):
        def channel_of(row):
            calibration = self.get("calibrated_sensor", row["calibrated_sensor_token"])
            return self.get("sensor", calibration["sensor_token"])["channel"]

        (row,) = (
            row
            for row in self.rows["sample_data"]
            if row["sample_token"] == sample_token and row["is_key_frame"] and channel_of(row) == channel
        )
        return row

    def annotations(self, sample_token):
        return [row for row in self.rows["sample_annotation"] if row["sample_token"] == sample_token]


def _matrix(row):
    return Quaternion(row["rotation"]).transformation_matrix + np.pad(
        np.array(row["translation"])[:, None], ((0, 1), (3, 0))
    )


def _assert_scene_equals_reference(root, scene_name, cameras):
    reference = Reference(root)
    samples = list(reference.samples(scene_name))
    with Dataset(root) as dataset:
        scene = dataset.scene(scene_name, cameras, lidar="LIDAR_TOP")

    assert tuple(scene.cameras) == tuple(cameras)
    assert scene.log == reference.get("scene", samples[0]["scene_token"])["log_token"]
    for camera in cameras:
        frames = scene.cameras[camera]
        images = [reference.data(sample["token"], camera) for sample in samples]
        assert [frame.sample_token for frame in frames] == [sample["token"] for sample in samples]
        for i, (frame, image) in enumerate(zip(frames, images, strict=True)):
            _assert_image(reference, frame, image, camera)
            _assert_boxes(reference, frame)
            _assert_neighbours(reference, frame, images, i)
            _assert_lidar(reference, frame)


def _assert_image(reference, frame, image, camera):
    calibration = reference.get("calibrated_sensor", image["calibrated_sensor_token"])
    assert (
        frame.camera,
        frame.sample_data_token,
        frame.timestamp_us,
        frame.image_path,
        frame.image_size,
    ) == (
        camera,
        image["token"],
        image["timestamp"],
        image["filename"],
        (image["height"], image["width"]),
    )
    np.testing.assert_array_equal(frame.intrinsics, calibration["camera_intrinsic"])
    pose = reference.get("ego_pose", image["ego_pose_token"])
    np.testing.assert_allclose(frame.ego_from_camera, _matrix(calibration), rtol=0, atol=1e-9)
    np.testing.assert_allclose(frame.global_from_ego, _matrix(pose), rtol=0, atol=1e-9)


def _assert_boxes(reference, frame):
    rows = reference.annotations(frame.sample_token)
    instances = [reference.get("instance", row["instance_token"]) for row in rows]
    assert frame.boxes.annotation_token == tuple(row["token"] for row in rows)
    assert frame.boxes.instance_token == tuple(row["instance_token"] for row in rows)
    assert frame.boxes.category == tuple(
        reference.get("category", instance["category_token"])["name"] for instance in instances
    )
    assert frame.boxes.visibility.dtype == np.uint8
    assert frame.boxes.visibility.tolist() == [int(row["visibility_token"] or 0) for row in rows]
    assert frame.boxes.num_lidar_pts.tolist() == [row["num_lidar_pts"] for row in rows]
    assert frame.boxes.size_wlh.tolist() == [row["size"] for row in rows]
    expected = np.array([_matrix(row) for row in rows]).reshape(-1, 4, 4)
    np.testing.assert_allclose(frame.boxes.global_from_box, expected, rtol=0, atol=1e-9)


def _assert_neighbours(reference, frame, images, i):
    for step in range(-6, 7):
        at = i + step
        time_us, position = (
            frame.neighbour_timestamps_us[step + 6],
            frame.neighbour_positions_global[step + 6],
        )
        if 0 <= at < len(images):
            assert time_us == images[at]["timestamp"]
            pose = reference.get("ego_pose", images[at]["ego_pose_token"])
            assert position.tolist() == pose["translation"]
        else:
            assert time_us == -1
            assert np.isnan(position).all()


def _assert_lidar(reference, frame):
    sweep = reference.data(frame.sample_token, "LIDAR_TOP")
    pose = reference.get("ego_pose", sweep["ego_pose_token"])
    calibration = reference.get("calibrated_sensor", sweep["calibrated_sensor_token"])
    assert (frame.lidar.path, frame.lidar.timestamp_us) == (sweep["filename"], sweep["timestamp"])
    expected = _matrix(pose) @ _matrix(calibration)
    np.testing.assert_allclose(frame.lidar.global_from_lidar, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("scene", ["scene-0001", "scene-0002"])
def test_records_of_the_small_dataset(small_root, scene):
    _assert_scene_equals_reference(small_root, scene, ["CAM_BACK", "CAM_FRONT"])


@pytest.mark.parametrize("scene", ["scene-0103", "scene-0061"])
def test_records_of_real_data(real_dataroot, scene):
    _assert_scene_equals_reference(real_dataroot, scene, ["CAM_FRONT", "CAM_BACK_LEFT"])


def test_records_do_not_depend_on_the_order_of_rows(small_root, edit_table):
    for table in ("sample", "sample_data", "ego_pose", "calibrated_sensor", "instance", "sample_annotation"):
        edit_table(small_root, table, lambda records: records[::-1])

    _assert_scene_equals_reference(small_root, "scene-0001", ["CAM_FRONT"])


def test_scene_wide_values(small_root):
    with Dataset(small_root) as dataset:
        scene = dataset.scene("scene-0002", ["CAM_FRONT"])

    (frame, *_) = scene.cameras["CAM_FRONT"]
    assert (scene.name, scene.location) == ("scene-0002", "singapore-onenorth")
    assert (frame.scene_name, frame.location) == ("scene-0002", "singapore-onenorth")
    assert (frame.dataroot, frame.map_path, frame.lidar) == (small_root, "maps/2.png", None)


def test_a_frame_without_annotations_has_no_boxes(small_root, edit_table):
    edit_table(small_root, "sample_annotation", lambda records: [])

    with Dataset(small_root) as dataset:
        (frame, *_) = dataset.scene("scene-0002", ["CAM_FRONT"]).cameras["CAM_FRONT"]
    assert len(frame.boxes) == 0
    assert frame.boxes.global_from_box.shape == (0, 4, 4)
    assert frame.boxes.size_wlh.shape == (0, 3)


def test_records_outlive_the_dataset_and_pickling(small_root):
    with Dataset(small_root) as dataset:
        scene = dataset.scene("scene-0001", ["CAM_FRONT"], lidar="LIDAR_TOP")

    copy = pickle.loads(pickle.dumps(scene))
    for frame, copied in zip(scene.cameras["CAM_FRONT"], copy.cameras["CAM_FRONT"], strict=True):
        assert copied.boxes.category == frame.boxes.category
        np.testing.assert_array_equal(copied.boxes.global_from_box, frame.boxes.global_from_box)
        np.testing.assert_array_equal(copied.neighbour_positions_global, frame.neighbour_positions_global)
        np.testing.assert_array_equal(copied.lidar.global_from_lidar, frame.lidar.global_from_lidar)


def test_a_frame_is_light(small_root):
    with Dataset(small_root) as dataset:
        (frame, *_) = dataset.scene("scene-0002", ["CAM_FRONT"]).cameras["CAM_FRONT"]

    assert len(pickle.dumps(frame)) < 4096  # no connection, no image


def test_tokens_of_frames_are_those_of_the_scenes(small_root):
    with Dataset(small_root) as dataset:
        cameras = dataset.channels()
        found = dataset.frame_tokens(cameras, lidar="LIDAR_TOP")
        assert set(found) == set(dataset.scene_names())
        for name in found:
            frames = dataset.scene(name, cameras, lidar="LIDAR_TOP").cameras
            assert found[name] == {
                camera: tuple(one.sample_data_token for one in some) for camera, some in frames.items()
            }


@pytest.mark.parametrize(
    ("table", "change"),
    [
        ("scene", lambda rows: [{**one, "name": "same"} for one in rows]),
        ("ego_pose", lambda rows: [{**one, "rotation": [2, 0, 0, 0]} for one in rows]),
        ("map", lambda rows: []),
        ("sample_data", lambda rows: [one for one in rows if "LIDAR" not in one["filename"]]),
    ],
)
def test_of_scenes_that_would_be_refused_no_tokens_are_told(small_root, edit_table, table, change):
    edit_table(small_root, table, change)
    with Dataset(small_root) as dataset:
        assert dataset.frame_tokens(["CAM_FRONT"], lidar="LIDAR_TOP") == {}
        for name in dataset.scene_names():
            with pytest.raises(TableError):
                dataset.scene(name, ["CAM_FRONT"], lidar="LIDAR_TOP")


def test_names(small_root):
    with Dataset(small_root) as dataset:
        assert dataset.scene_names() == ("scene-0001", "scene-0002")
        assert dataset.channels() == ("CAM_BACK", "CAM_FRONT")
        assert dataset.categories() == ("human.pedestrian.adult", "vehicle.car")
        assert dataset.map_path("boston-seaport") == "maps/1.png"


def test_unknown_names_offer_close_ones(small_root):
    with Dataset(small_root) as dataset:
        with pytest.raises(SettingsError, match=r"unknown scene 'scene-1'; did you mean scene-0001"):
            dataset.scene("scene-1", ["CAM_FRONT"])
        with pytest.raises(SettingsError, match=r"unknown camera 'CAM_FRNT'; did you mean CAM_FRONT"):
            dataset.scene("scene-0001", ["CAM_FRNT"])
        with pytest.raises(SettingsError, match=r"unknown camera 'LIDAR_TOP'"):
            dataset.scene("scene-0001", ["LIDAR_TOP"])
        with pytest.raises(
            SettingsError, match=r"unknown location 'x'; there are: boston-seaport, singapore"
        ):
            dataset.map_path("x")


def test_overview_counts_scenes_and_images_present(small_root):
    (small_root / "samples" / "CAM_BACK" / "1-0.jpg").unlink()

    with Dataset(small_root) as dataset:
        first, second = dataset.overview()
    assert (first.name, first.location, first.frames, first.boxes) == ("scene-0001", "boston-seaport", 8, 16)
    assert (first.cameras, first.images, first.images_present) == (("CAM_BACK", "CAM_FRONT"), 16, 15)
    assert (second.frames, second.boxes, second.images, second.images_present) == (3, 6, 6, 6)


def test_an_image_that_the_disk_refuses_to_look_at_is_not_called_absent(small_root, monkeypatch):
    stat, refused = os.stat, small_root / "samples" / "CAM_BACK" / "1-0.jpg"

    def fail(path, **options):
        if path == refused:
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))
        return stat(path, **options)

    with Dataset(small_root) as dataset:
        monkeypatch.setattr(os, "stat", fail)
        assert [scene.images_present for scene in dataset.overview()] == [16, 6]


def test_visibility_is_what_the_key_stands_for(make_dataset, tmp_path, edit_table):
    root = tmp_path / "root"
    make_dataset(root)
    levels = {"9f": "Full", "1": "most", "zz": "v40-60", "2": "v0-40", "odd": "somewhat"}
    edit_table(root, "visibility", lambda rows: [{"token": key, "level": levels[key]} for key in levels])
    given = ["2", "9f", "odd", "1", "absent", "zz", "", None]

    def change(rows):
        for number, row in enumerate(rows):
            row["visibility_token"] = given[number % len(given)]

    edit_table(root, "sample_annotation", change)
    expected = dict(zip(given, [1, 4, 0, 3, 0, 2, 0, 0], strict=True))
    with Dataset(root) as dataset:
        frames = dataset.scene("scene-0001", ["CAM_FRONT"]).cameras["CAM_FRONT"]
    path = next(root.glob("v1.0-*/sample_annotation.json"))
    tokens = {row["token"]: row["visibility_token"] for row in json.loads(path.read_text(encoding="utf-8"))}
    found = {
        token: level
        for frame in frames
        for token, level in zip(frame.boxes.annotation_token, frame.boxes.visibility.tolist(), strict=True)
    }

    assert len(set(found.values())) == 5
    assert found == {token: expected[tokens[token]] for token in found}
    (finding,) = (finding for finding in check_dataset(root) if finding.rule == "R607")
    assert finding.severity == "warning"
    assert finding.count == sum(key in ("odd", "absent") for key in tokens.values())


@pytest.mark.parametrize("damage", ["absent", "damaged"])
def test_all_visibilities_are_unknown_without_their_table_but_a_damaged_one_is_refused(
    make_dataset, tmp_path, damage
):
    root = tmp_path / "root"
    make_dataset(root)
    path = next(root.glob("v1.0-*/visibility.json"))
    if damage == "absent":
        path.unlink()
        with Dataset(root) as dataset:
            frames = dataset.scene("scene-0001", ["CAM_FRONT"]).cameras["CAM_FRONT"]
        assert not any(frame.boxes.visibility.any() for frame in frames)
    else:
        path.write_bytes(path.read_bytes()[:-9])
        with pytest.raises(TableError, match=re.escape(f"{path}: ")):
            Dataset(root)
    (finding,) = (finding for finding in check_dataset(root) if finding.rule == "R101")
    assert finding.severity == {"absent": "warning", "damaged": "error"}[damage]


def test_optional_columns_may_be_absent(make_dataset, tmp_path, edit_table):
    root = tmp_path / "root"
    make_dataset(root)
    optional = ["visibility_token", "num_lidar_pts", "num_radar_pts", "attribute_tokens", "prev", "next"]
    edit_table(
        root,
        "sample_annotation",
        lambda rows: [{key: row[key] for key in row if key not in optional} for row in rows],
    )

    def change(rows):
        for row in rows:
            if "/CAM_" not in row["filename"]:
                row["width"] = row["height"] = None

    edit_table(root, "sample_data", change)
    with Dataset(root) as dataset:
        boxes = dataset.scene("scene-0001", ["CAM_FRONT"], lidar="LIDAR_TOP").cameras["CAM_FRONT"][2].boxes

    assert len(boxes)
    assert set(boxes.visibility.tolist()) == {0}
    assert set(boxes.num_lidar_pts.tolist()) == {-1}
    assert "R201" not in {finding.rule for finding in check_dataset(root)}
