"""Key frames round the vehicle: which there are, and where ground points of their plane fall in images."""

import shutil
from contextlib import contextmanager
from dataclasses import replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import SettingsError, ShardError, TrainingError
from ogmkit.labels.catalogue import PRESETS, surround
from ogmkit.labels.centres import array_from_plane
from ogmkit.labels.make import labels_of
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.nuscenes.paths import resolve
from ogmkit.samples.surround import index_surround
from ogmkit.samples.surround_reading import read_surround
from ogmkit.samples.surround_spec import SurroundSpec
from ogmkit.shards.manifest import read_manifest, write_manifest
from ogmkit.shards.reader import Shard
from ogmkit.target_settings import TargetSettings

SCENES = ("scene-0001", "scene-0002")
DEFINITIONS = ("surround", "lss", "fiery", "cvt", "bevfusion", "pointbev")


def spec_of(definition="surround", **changes):
    return SurroundSpec(definition, (40, 100), 11, **changes)


@pytest.fixture(scope="module")
def key_frames(tiny_dataroot):
    with Dataset(tiny_dataroot) as dataset:
        return {name: dataset.key_frames(name, lidar="LIDAR_TOP", maps=True) for name in SCENES}


@pytest.fixture(scope="module")
def frames(tiny_dataroot):
    """Camera frames by scene, camera and sample token."""
    found = {}
    with Dataset(tiny_dataroot) as dataset:
        for name in SCENES:
            for camera, records in dataset.scene(name, ("CAM_FRONT", "CAM_BACK")).cameras.items():
                found |= {(name, camera, one.sample_token): one for one in records}
    return found


@pytest.fixture
def read(surround_shards):
    """A sample: `read(i, spec)` gives the index and the arrays."""

    def sample(i, spec):
        index = index_surround(surround_shards, SCENES, needs=spec)
        with Shard(index.paths[index.shard[i]]) as shard:
            return index, read_surround(shard, index, i, spec)

    return sample


def projected(frame, points_global):
    """Pixels of a frame's image file, a transform at a time, as the devkit does it."""
    in_ego = (points_global - frame.global_from_ego[:3, 3]) @ frame.global_from_ego[:3, :3]
    in_camera = (in_ego - frame.ego_from_camera[:3, 3]) @ frame.ego_from_camera[:3, :3]
    pixels = in_camera @ frame.intrinsics.T
    return pixels[:, :2] / pixels[:, 2:], in_camera[:, 2]


def origin_and_axes(frame, key_frame):
    """Where a definition's plane lies, written out: origin, first and second axis, global frame."""
    pose = key_frame.global_from_ego
    heading = np.arctan2(pose[1, 0], pose[0, 0])
    if frame == "lidar-ego":
        return pose[:3, 3], pose[:3, 0], pose[:3, 1]
    if frame == "lidar-heading":
        lidar = pose @ key_frame.ego_from_lidar
        heading = np.arctan2(lidar[1, 0], lidar[0, 0])
        pose = np.concatenate([lidar[:2, 3], pose[2:3, 3]])
    elif frame != "lidar-level":
        heading = np.arctan2(-pose[0, 1], pose[0, 0])
    origin = pose if pose.ndim == 1 else pose[:3, 3]
    return (
        origin,
        np.array([np.cos(heading), np.sin(heading), 0]),
        np.array([-np.sin(heading), np.cos(heading), 0]),
    )


@pytest.mark.parametrize("name", DEFINITIONS)
def test_ground_points_of_every_plane_fall_where_the_devkit_would_project_them(
    read, key_frames, frames, name
):
    index, arrays = read(5, spec_of(name))
    scene = index.scenes[index.shard[5]]
    key_frame = key_frames[scene][index.row[5]]
    origin, first, second = origin_and_axes(index.definition.frame, key_frame)
    ground = np.random.default_rng(0).uniform(-40, 40, (500, 2))
    in_plane = np.column_stack([ground, np.zeros(500), np.ones(500)])
    compared = 0
    for c, camera in enumerate(index.cameras):
        frame = frames[scene, camera, key_frame.sample_token]
        files, depth = projected(frame, origin + ground[:, :1] * first + ground[:, 1:] * second)
        camera_from_plane = np.linalg.inv(arrays.reference_from_camera[c])[:3]
        found = in_plane @ camera_from_plane.T @ arrays.cropped_intrinsics[c].T
        ahead = depth > 1
        # Corners on corners: 90 × 160 become 51 × 100, of which the lower 40 rows stay.
        expected = (files + 0.5) * [100 / 160, 51 / 90] - [0.5, 11.5]
        moved = 2e-2 if name in ("cvt", "bevfusion") else 1e-6  # map coordinates in float32
        np.testing.assert_allclose((found[:, :2] / found[:, 2:])[ahead], expected[ahead], rtol=0, atol=moved)
        compared += ahead.sum()
    assert compared > 400


def test_the_labels_are_the_exact_raster_of_the_sample(read, key_frames, surround_shards, tmp_path):
    index, arrays = read(11, spec_of())
    key_frame = key_frames[index.scenes[index.shard[11]]][index.row[11]]
    settings = read_manifest(surround_shards).settings.targets
    mask = MaskStore(tmp_path).open(resolve(key_frame.dataroot, key_frame.map_path))
    drivable, vehicles = labels_of(key_frame, surround(settings), mask).values()
    assert 0 < drivable.mean() < 1
    assert vehicles.any()
    np.testing.assert_array_equal(arrays.labels, [drivable, vehicles])


def test_what_is_seen_is_what_projects_into_an_image(read):
    index, arrays = read(3, spec_of("lss"))
    axis = np.arange(200) * 0.5 - 49.75
    points = np.stack(
        [*np.meshgrid(axis, axis, indexing="ij"), np.zeros((200, 200)), np.ones((200, 200))], -1
    )
    expected = np.zeros((200, 200), bool)
    for pose, intrinsics in zip(arrays.reference_from_camera, arrays.cropped_intrinsics, strict=True):
        u, v, depth = np.moveaxis(points @ np.linalg.inv(pose)[:3].T @ intrinsics.T, -1, 0)
        u, v = u / depth, v / depth
        expected |= (depth > 0) & (u >= -0.5) & (u < 99.5) & (v >= -0.5) & (v < 39.5)
    assert 0.1 < expected.mean() < 0.9
    np.testing.assert_array_equal(arrays.seen, expected)
    assert index.cameras == ("CAM_FRONT", "CAM_BACK")


@pytest.mark.parametrize("name", ["cvt", "pointbev"])
def test_visibility_from_the_boxes_is_the_one_that_is_stored(read, name):
    for i in (2, 9):
        index, arrays = read(i, spec_of(name))
        with Shard(index.paths[index.shard[i]]) as shard:
            stored = shard.dataset("SURROUND", f"labels/{name}/visibility")[index.row[i]]
        assert (stored < 255).any()
        np.testing.assert_array_equal(arrays.visibility, stored)


def test_nearness_is_1_where_a_box_stands_on_the_index_point(read, key_frames):
    index, arrays = read(4, spec_of("cvt"))
    key_frame = key_frames[index.scenes[index.shard[4]]][index.row[4]]
    origin, first, second = origin_and_axes("lidar-ego-yaw", key_frame)
    found = 0
    for pose in key_frame.boxes.global_from_box[["vehicle" in name for name in key_frame.boxes.category]]:
        x, y = (pose[:3, 3] - origin) @ np.column_stack([first, second])
        column, row = 100 - 2 * y, 100 - 2 * x
        c, r = round(column), round(row)
        if 0 <= c < 200 and 0 <= r < 200:
            near = np.exp(-((column - c) ** 2) - (row - r) ** 2)
            found += abs(arrays.nearness[r, c] - near) < 2e-3
    assert found >= 3
    assert (arrays.nearness[arrays.visibility == 255] == 0).all()


def test_the_view_matrix_is_cross_view_transformers_own():
    np.testing.assert_allclose(array_from_plane(PRESETS["cvt"]), [[0, -2, 100], [-2, 0, 100], [0, 0, 1]])
    own = surround(TargetSettings())
    x, y = own.grid.rows.centres_m[7], own.grid.columns.centres_m[3]
    np.testing.assert_allclose(array_from_plane(own) @ [x, y, 1], [3, 7, 1])


def test_classes_and_cameras_come_in_the_order_that_is_asked_for(surround_shards):
    spec = spec_of("cvt", classes=("truck", "car"))
    index = index_surround(surround_shards, SCENES[:1], ("CAM_BACK",), needs=spec)
    assert (index.cameras, len(index)) == (("CAM_BACK",), 8)
    with Shard(index.paths[0]) as shard:
        arrays = read_surround(shard, index, 0, spec)
        cars = shard.dataset("SURROUND", "labels/cvt/car")[0]
    assert arrays.image.shape == (1, 40, 100, 3)
    np.testing.assert_array_equal(arrays.labels[1], cars)


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        (spec_of("paper"), "has no labels 'paper' round the vehicle, only surround, lss, fiery, cvt"),
        (spec_of("pon"), "extract with --definition paper,surround"),
        (spec_of("lss", classes=("car",)), "unknown class 'car'"),
        (spec_of("bevfusion", layout="lss"), "layout lss: has x ahead, but labels bevfusion to the right"),
    ],
)
def test_labels_that_are_not_there_are_refused(surround_shards, spec, said):
    with pytest.raises(SettingsError, match=said):
        index_surround(surround_shards, SCENES, needs=spec)


def test_sizes_that_are_no_images_are_refused():
    with pytest.raises(SettingsError, match="below 1"):
        SurroundSpec(image_size=(0, 10))
    with pytest.raises(SettingsError, match="below 0"):
        SurroundSpec(crop_top=-1)


@contextmanager
def changed(out):
    """The first shard of a folder, to be changed; the manifest then knows its size."""
    manifest = read_manifest(out)
    path = out / manifest.shards[0].file
    with h5py.File(path, "r+") as h5:
        yield h5
    entry = replace(manifest.shards[0], bytes=path.stat().st_size)
    write_manifest(out, replace(manifest, shards=(entry, *manifest.shards[1:])))


def test_shards_of_an_earlier_version_and_cameras_without_common_frames_are_told(surround_shards, tmp_path):
    out = shutil.copytree(surround_shards, tmp_path / "out")
    with changed(out) as h5:
        h5["CAM_BACK/sample_token"][:] = [f"another {i}" for i in range(8)]
    with pytest.raises(TrainingError, match="no key frame is among the frames of all of CAM_FRONT, CAM_BACK"):
        index_surround(out, SCENES[:1], needs=spec_of())
    with changed(out) as h5:
        del h5["SURROUND/global_from_ego"]
    with pytest.raises(ShardError, match="has no SURROUND/global_from_ego, being of an earlier version; run"):
        index_surround(out, SCENES[:1], needs=spec_of())
