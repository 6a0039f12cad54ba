"""Ground points round the vehicle in all images, against the devkit's chain of transforms."""

import numpy as np
import pytest
from nuscenes.utils.data_classes import LidarPointCloud
from nuscenes.utils.geometry_utils import view_points
from ogmkit_cli.main import main
from pyquaternion import Quaternion

from ogmkit.samples.surround import index_surround
from ogmkit.samples.surround_reading import read_surround
from ogmkit.samples.surround_spec import SurroundSpec
from ogmkit.shards.reader import Shard

CASES = {
    "real": ("real_world", "scene-0061", (900, 1600)),
    "flat": ("flat_world", "scene-0001", (225, 400)),
    "hilly": ("hilly_world", "scene-0002", (225, 400)),
}
DEFINITIONS = ("surround", "lss", "cvt")
TOLERANCE_PX = 0.1
CROP = 25


@pytest.fixture(scope="module", params=CASES)
def case(request, tmp_path_factory, cache_dir):
    """The devkit's dataset, shards of a scene of it, and the size of its images."""
    fixture, scene, size = CASES[request.param]
    world = request.getfixturevalue(fixture)
    out = tmp_path_factory.mktemp(request.param) / "shards"
    cameras = [part for camera in world.cameras for part in ("--camera", camera)]
    arguments = ["extract", str(world.root), str(out), "--scenes", scene, "--cache-dir", str(cache_dir)]
    arguments += ["--cell-size", "0.5", "--rows", "40", "--columns", "40", *cameras]
    if request.param == "real":
        arguments.append("--no-map")  # it has no map expansion, which `cvt` needs
    definitions = ["--definition", ",".join(("paper", *DEFINITIONS))]
    assert main([*arguments, *definitions], standalone_mode=False) in (None, 0)
    return world.nusc, out, scene, size


def devkit_pixels(nusc, sample_data, points_global):
    """As `NuScenesExplorer.map_pointcloud_to_image` goes on from global coordinates."""
    cloud = LidarPointCloud(np.vstack([points_global.T, np.zeros(len(points_global))]))
    for table, token in (
        ("ego_pose", sample_data["ego_pose_token"]),
        ("calibrated_sensor", sample_data["calibrated_sensor_token"]),
    ):
        record = nusc.get(table, token)
        cloud.translate(-np.array(record["translation"]))
        cloud.rotate(Quaternion(record["rotation"]).rotation_matrix.T)
    intrinsics = np.array(record["camera_intrinsic"])
    return view_points(cloud.points[:3], intrinsics, normalize=True)[:2].T, cloud.points[2]


def axes(definition, pose):
    """Columns x, y of a definition's frame, by pyquaternion."""
    rotation = Quaternion(pose["rotation"])
    if definition == "lss":
        return rotation.rotation_matrix[:, :2]
    ahead = rotation.rotation_matrix[:, 0]
    yaw = rotation.yaw_pitch_roll[0] if definition == "cvt" else np.arctan2(ahead[1], ahead[0])
    return Quaternion(axis=(0, 0, 1), radians=yaw).rotation_matrix[:, :2]


@pytest.mark.parametrize("definition", DEFINITIONS)
def test_ground_points_fall_within_a_tenth_of_a_pixel_of_the_devkits(case, definition):
    nusc, out, scene, (height, width) = case
    spec = SurroundSpec(definition, (height - CROP, width), CROP)
    index = index_surround(out, [scene], needs=spec)
    ground = np.random.default_rng(0).uniform(-50, 50, (2000, 2))
    in_plane = np.column_stack([ground, np.zeros(2000), np.ones(2000)])
    compared, farthest = dict.fromkeys(index.cameras, 0), 0.0
    with Shard(index.paths[0]) as shard:
        tokens = shard.strings("SURROUND", "sample_token")
        for i in range(len(index)):
            arrays = read_surround(shard, index, i, spec)
            sample = nusc.get("sample", tokens[index.row[i]])
            sweep = nusc.get("sample_data", sample["data"]["LIDAR_TOP"])
            pose = nusc.get("ego_pose", sweep["ego_pose_token"])
            points_global = np.array(pose["translation"]) + ground @ axes(definition, pose).T
            for c, camera in enumerate(index.cameras):
                image = nusc.get("sample_data", sample["data"][camera])
                theirs, depth = devkit_pixels(nusc, image, points_global)
                camera_from_plane = np.linalg.inv(arrays.reference_from_camera[c])[:3]
                ours = in_plane @ camera_from_plane.T @ arrays.cropped_intrinsics[c].T
                ours = ours[:, :2] / ours[:, 2:] + np.array([0, CROP])
                seen = (depth > 1) & (np.abs(theirs[:, 0] - width / 2) < width) & (theirs[:, 1] < 2 * height)
                farthest = max(farthest, np.abs(ours - theirs)[seen].max())
                compared[camera] += np.count_nonzero(seen)
    assert farthest < TOLERANCE_PX
    assert min(compared.values()) > 100
