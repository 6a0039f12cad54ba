"""A small finished folder of shards, written by plain h5py with values that are easy to recognise."""

import io
import json

import h5py
import numpy as np
import pytest
from PIL import Image

from ogmkit.geometry.se3 import level_from_global, pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.shards.manifest import AMENDING, Manifest, ShardEntry, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

FRAMES = 3
IMAGE_SIZE = 90, 160
GRID = GridSpec(m_per_cell=0.5, rows=80, columns=40, ego_row=80, ego_column=24)
GLOBAL_FROM_EGO = pose_matrix([100.0, 50.0, 0.0], [np.cos(0.3), 0, 0, np.sin(0.3)])
EGO_FROM_CAMERA = pose_matrix([1.5, 0.0, 1.5], [0.5, -0.5, 0.5, -0.5])  # looks straight ahead
BOXES = {
    "vehicle.car": [12.0, 3.0, 0.8],
    "human.pedestrian.adult": [9.0, -2.0, 0.9],
    "vehicle.truck": [-8.0, 0.0, 1.5],
}
"""Category → the box's centre in the ego frame, the same in every frame."""

FIT = {"method": "calibration", "settings": {}, "checkpoint_sha256": ""}


@pytest.fixture
def grid():
    return GRID


@pytest.fixture
def jpeg():
    """A JPEG of one colour and of the size that the shards say."""

    def encode(size=IMAGE_SIZE, colour=(30, 90, 200)):
        data = io.BytesIO()
        Image.new("RGB", size[::-1], colour).save(data, "JPEG")
        return data.getvalue()

    return encode


@pytest.fixture
def make_shards(tmp_path, jpeg):
    """Write OUT with scene-0001 and scene-0002: `make_shards(images="bytes")` returns the folder."""

    def make(images="bytes"):
        settings = ExtractSettings(TargetSettings(grid=GRID, images=images), ("CAM_FRONT",), "gzip")
        out = tmp_path / "shards"
        out.mkdir()
        entries = []
        for scene in ("scene-0001", "scene-0002"):
            with h5py.File(out / f"{scene}.h5", "w") as h5:
                h5.attrs.update(_file_attributes(scene, settings))
                _write_camera(h5.create_group("CAM_FRONT"), scene, jpeg() if images == "bytes" else None)
            entries.append(ShardEntry(scene, f"{scene}.h5", "boston-seaport", FRAMES, 1, "", ()))
        write_manifest(out, Manifest("v1.0-mini", "nuscenes", settings, tuple(entries)))
        # Tests change the shards, as a command does that adds to them: the manifest doesn't know their sizes.
        (out / AMENDING).write_text('{"command": "homography-fit"}')
        return out

    return make


@pytest.fixture
def add_masks():
    """Add homographies by calibration and sets of masks: `add_masks(path, "surface", vehicles=mask)`.

    The ground of the fixture's level camera is flat, so calibration is exact. `invalid` lists frames that
    have neither; the rest have the same masks, all 0 where none is given.
    """

    def add(path, name="surface", *, homography="surface", scale=1, invalid=(), **masks):
        shape = IMAGE_SIZE[0] // scale, IMAGE_SIZE[1] // scale
        valid = ~np.isin(np.arange(FRAMES), invalid)
        with h5py.File(path, "r+") as h5:
            made = h5["CAM_FRONT"].create_group(f"footprints/{name}")
            for kind in ("drivable", "vehicles"):
                mask = masks.get(kind, np.zeros(shape, np.uint8))
                made[kind] = valid[:, None, None] * mask
            made["valid"] = valid
            method = name if name == "full-body" else "warp"
            made.attrs.update(method=method, homography=homography, scale=float(scale))
            made.attrs["settings"] = json.dumps({"homography": FIT} if method == "warp" else {})
            if homography and f"homography/{homography}" not in h5["CAM_FRONT"]:
                _write_homography(h5["CAM_FRONT"].create_group(f"homography/{homography}"), valid)

    return add


def _write_homography(group, valid):
    # x right, y down: u = 79.5 − 100 y / d and v = 44.5 + 150 / d on the ground at d = x − 1.5 m.
    image_from_level = np.array([[79.5, -100, -79.5 * 1.5], [44.5, 0, 150 - 44.5 * 1.5], [1, 0, -1.5]])
    bev_from_image = GRID.bev_from_level @ np.linalg.inv(image_from_level)
    group["bev_from_image"] = np.where(valid[:, None, None], bev_from_image, np.nan)
    group["valid"] = valid
    group["reason"] = ["" if one else "too few corners" for one in valid]
    group.attrs.update(method=FIT["method"], settings=json.dumps(FIT["settings"]), checkpoint_sha256="")


def _file_attributes(scene, settings):
    return {
        "format": "ogmkit-shard",
        "format_version": 1,
        "dataset_version": "v1.0-mini",
        "scene": scene,
        "location": "boston-seaport",
        "settings": json.dumps(settings.to_dict()),
    }


def _write_camera(group, scene, image):
    drivable = np.zeros((FRAMES, *GRID.shape), np.uint8)
    drivable[:, :, 10:30] = 1
    vehicles = np.zeros_like(drivable)
    vehicles[:, 20:30, 4:8] = 1  # left of the ego, on ground that is not drivable
    field_of_view = np.zeros_like(drivable)
    field_of_view[:, :60] = 1
    steps = np.arange(1.0, 7.0)
    past, future = np.stack([-steps[::-1], 0 * steps], 1), np.stack([2 * steps, 0.1 * steps**2], 1)
    paths = np.tile(past, (FRAMES, 1, 1))
    paths[0, :] = np.nan
    group["sample_token"] = [f"sample{i}" for i in range(FRAMES)]
    group["sample_data_token"] = [f"data{i}" for i in range(FRAMES)]
    group["timestamp_us"] = 1_532_402_927_612_460 + 500_000 * np.arange(FRAMES)
    group["drivable"], group["vehicles"], group["field_of_view"] = drivable, vehicles, field_of_view
    group["image_path"] = [f"samples/CAM_FRONT/{scene}-{i}.jpg" for i in range(FRAMES)]
    group["image_size"] = np.tile(IMAGE_SIZE, (FRAMES, 1))
    group["intrinsics"] = np.tile([[100.0, 0, 79.5], [0, 100.0, 44.5], [0, 0, 1]], (FRAMES, 1, 1))
    group["ego_from_camera"] = np.tile(EGO_FROM_CAMERA, (FRAMES, 1, 1))
    group["global_from_ego"] = np.tile(GLOBAL_FROM_EGO, (FRAMES, 1, 1))
    group["level_from_global"] = level_from_global(group["global_from_ego"][:])
    group["trajectory/past"], group["trajectory/future"] = paths, np.tile(future, (FRAMES, 1, 1))
    if image is not None:
        stored = group.create_dataset("image", (FRAMES,), h5py.vlen_dtype(np.uint8))
        for index in range(FRAMES):
            stored[index] = np.frombuffer(image, np.uint8)
    _write_boxes(group.create_group("boxes"))


def _write_boxes(group):
    count = len(BOXES)
    poses = np.stack([GLOBAL_FROM_EGO @ pose_matrix(centre, [1, 0, 0, 0]) for centre in BOXES.values()])
    group["offsets"] = count * np.arange(FRAMES + 1)
    group["category"] = [*BOXES] * FRAMES
    group["annotation_token"] = group["instance_token"] = [f"box{i}" for i in range(count * FRAMES)]
    group["global_from_box"] = np.tile(poses, (FRAMES, 1, 1))
    group["size_wlh"] = np.tile([1.9, 4.5, 1.6], (count * FRAMES, 1))
    group["visibility"] = np.zeros(count * FRAMES, np.uint8)
    group["num_lidar_pts"] = np.zeros(count * FRAMES, np.int64)
