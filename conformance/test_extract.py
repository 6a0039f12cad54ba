"""Shards, as `ogmkit extract` writes them, against what the devkit makes of the same dataset."""

from dataclasses import dataclass

import h5py
import numpy as np
import pytest
from nuscenes.nuscenes import NuScenes
from nuscenes.utils.data_classes import LidarPointCloud
from nuscenes.utils.geometry_utils import BoxVisibility, transform_matrix
from ogmkit_cli.main import main
from pyquaternion import Quaternion

LEAST_AGREEMENT = 0.9999
CASES = ("real-0103", "real-0061", "flat", "hilly")


@dataclass(frozen=True)
class Frame:
    """One frame of one camera: the devkit's records, and a row of the camera's group in the shard."""

    nusc: NuScenes
    group: h5py.Group
    row: int

    @property
    def sample(self):
        return self.nusc.get("sample", self["sample_token"].decode())

    @property
    def image(self):
        return self.nusc.get("sample_data", self["sample_data_token"].decode())

    def __getitem__(self, name):
        return self.group[name][self.row]

    def ragged(self, name, offsets):
        first, last = self.group[offsets][self.row : self.row + 2]
        return self.group[name][first:last]


@pytest.fixture(scope="module", params=CASES)
def frames(request, tmp_path_factory, cache_dir):
    """Every frame of a case's shards."""
    world = request.getfixturevalue({"real": "real_world"}.get(request.param[:4], f"{request.param}_world"))
    options = {
        "real-0103": ["--scenes", "scene-0103", "--images", "none", "--camera", "CAM_FRONT"],
        "real-0061": [
            "--scenes",
            "scene-0061",
            "--lidar",
            "--camera",
            "CAM_FRONT",
            "--camera",
            "CAM_BACK_LEFT",
        ],
    }.get(request.param, ["--lidar", "--camera", "CAM_FRONT", "--camera", "CAM_BACK_RIGHT"])
    out = tmp_path_factory.mktemp(request.param) / "shards"
    arguments = ["extract", str(world.root), str(out), "--cache-dir", str(cache_dir), *options]
    assert main(arguments, standalone_mode=False) in (None, 0)
    shards = [h5py.File(path) for path in sorted(out.glob("*.h5"))]
    yield [
        Frame(world.nusc, group, row)
        for shard in shards
        for group in shard.values()
        for row in range(len(group["sample_token"]))
    ]
    for shard in shards:
        shard.close()


def pose(record):
    return transform_matrix(record["translation"], Quaternion(record["rotation"]))


def test_frames_are_the_samples_in_order(frames):
    for frame in frames:
        assert frame.image["sample_token"] == frame.sample["token"]
        assert frame.image["is_key_frame"]
        assert frame["timestamp_us"] == frame.image["timestamp"]
        assert frame["image_path"].decode() == frame.image["filename"]
        if frame.row:
            earlier = frame.nusc.get("sample", frame.sample["prev"])
            assert earlier["token"].encode() == frame.group["sample_token"][frame.row - 1]


def test_boxes_equal_get_boxes(frames):
    for frame in frames:
        expected = {box.token: box for box in frame.nusc.get_boxes(frame.image["token"])}
        tokens = [token.decode() for token in frame.ragged("boxes/annotation_token", "boxes/offsets")]
        assert sorted(tokens) == sorted(expected)
        poses = frame.ragged("boxes/global_from_box", "boxes/offsets")
        sizes = frame.ragged("boxes/size_wlh", "boxes/offsets")
        names = frame.ragged("boxes/category", "boxes/offsets")
        for token, global_from_box, size, name in zip(tokens, poses, sizes, names, strict=True):
            box = expected[token]
            np.testing.assert_allclose(global_from_box[:3, :3], box.rotation_matrix, rtol=0, atol=1e-9)
            np.testing.assert_allclose(global_from_box[:3, 3], box.center, rtol=0, atol=1e-9)
            np.testing.assert_allclose(size, box.wlh, rtol=0, atol=1e-9)
            assert name.decode() == box.name


def test_boxes_in_the_camera_equal_get_sample_data(frames):
    for frame in frames:
        _, boxes, intrinsics = frame.nusc.get_sample_data(frame.image["token"], BoxVisibility.NONE)
        np.testing.assert_allclose(frame["intrinsics"], intrinsics, rtol=0, atol=1e-9)
        camera_from_global = np.linalg.inv(frame["global_from_ego"] @ frame["ego_from_camera"])
        poses = camera_from_global @ frame.ragged("boxes/global_from_box", "boxes/offsets")
        tokens = frame.ragged("boxes/annotation_token", "boxes/offsets")
        found = dict(zip(tokens, poses, strict=True))
        for box in boxes:
            camera_from_box = found[box.token.encode()]
            np.testing.assert_allclose(camera_from_box[:3, :3], box.rotation_matrix, rtol=0, atol=1e-9)
            np.testing.assert_allclose(camera_from_box[:3, 3], box.center, rtol=0, atol=1e-9)


def test_poses_and_mountings_equal_the_devkits(frames):
    for frame in frames:
        ego = frame.nusc.get("ego_pose", frame.image["ego_pose_token"])
        sensor = frame.nusc.get("calibrated_sensor", frame.image["calibrated_sensor_token"])
        np.testing.assert_allclose(frame["global_from_ego"], pose(ego), rtol=0, atol=1e-9)
        np.testing.assert_allclose(frame["ego_from_camera"], pose(sensor), rtol=0, atol=1e-9)


def test_drivable_equals_is_on_mask(frames):
    rows, columns = np.indices(frames[0]["drivable"].shape)
    x = 0.1 * (1000 - 0.5 - rows)
    y = 0.1 * (300 - 0.5 - columns)
    cells_level = np.stack([x.ravel(), y.ravel(), np.zeros(x.size), np.ones(x.size)])
    for frame in frames:
        scene = frame.nusc.get("scene", frame.sample["scene_token"])
        log = frame.nusc.get("log", scene["log_token"])
        mask = frame.nusc.get("map", log["map_token"])["mask"]
        cells_global = np.linalg.inv(frame["level_from_global"]) @ cells_level
        expected = mask.is_on_mask(cells_global[0], cells_global[1]).reshape(rows.shape)
        assert expected.any()
        assert np.mean(frame["drivable"] == expected) >= LEAST_AGREEMENT


def test_trajectories_equal_the_devkits_poses(frames):
    some_valid = False
    for frame in frames:
        for side, link in (("past", "prev"), ("future", "next")):
            expected = neighbours(frame, link)
            if side == "past":
                expected = expected[::-1]
            np.testing.assert_allclose(frame[f"trajectory/{side}"], expected, rtol=0, atol=1e-6)
            np.testing.assert_array_equal(frame[f"trajectory/{side}_valid"], ~np.isnan(expected[:, 0]))
        some_valid |= bool(frame["trajectory/valid"])
    assert some_valid or len({frame["sample_token"] for frame in frames}) == 1


def neighbours(frame, link):
    """(6, 2) ego positions seen from a frame, nearest first, turned by its heading alone."""
    here = frame.nusc.get("ego_pose", frame.image["ego_pose_token"])
    forward = Quaternion(here["rotation"]).rotation_matrix[:2, 0]
    heading = np.arctan2(forward[1], forward[0])
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    positions = np.full((6, 2), np.nan)
    sample, time_us = frame.sample, frame.image["timestamp"]
    for step in range(6):
        if not sample[link]:
            break
        sample = frame.nusc.get("sample", sample[link])
        image = frame.nusc.get("sample_data", sample["data"][frame.image["channel"]])
        if abs(image["timestamp"] - time_us) > 750_000:
            break
        time_us = image["timestamp"]
        there = frame.nusc.get("ego_pose", image["ego_pose_token"])
        positions[step] = turn @ (np.subtract(there["translation"], here["translation"])[:2])
    return positions


def test_lidar_points_equal_the_devkits(frames):
    with_lidar = [frame for frame in frames if "lidar" in frame.group]
    if not with_lidar:
        pytest.skip("scene-0103's LiDAR files are absent from this part of the dataset")
    for frame in with_lidar:
        record = frame.nusc.get("sample_data", frame.sample["data"]["LIDAR_TOP"])
        cloud = LidarPointCloud.from_file(str(frame.nusc.get_sample_data_path(record["token"])))
        sensor = frame.nusc.get("calibrated_sensor", record["calibrated_sensor_token"])
        ego = frame.nusc.get("ego_pose", record["ego_pose_token"])
        cloud.transform(pose(ego) @ pose(sensor))
        cloud.transform(frame["level_from_global"])
        points = frame.ragged("lidar/points", "lidar/offsets")
        # The devkit keeps global coordinates as float32: worth a millimetre some kilometres from the origin.
        np.testing.assert_allclose(points, cloud.points.T, rtol=0, atol=2e-3)
