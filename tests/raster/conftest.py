"""Real annotations and masks for the raster tests, read with plain json: no reader of ogmkit's takes part."""

import json
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from ogmkit.frames import Boxes
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.nuscenes.maps import MaskStore


@pytest.fixture(scope="session")
def mask_store(tmp_path_factory):
    return MaskStore(tmp_path_factory.mktemp("masks"))


@pytest.fixture
def mask_of(mask_store, tmp_path):
    """Make a `MapMask` of a (rows, columns) array, nonzero = drivable."""

    def make(drivable):
        path = tmp_path / "mask.png"
        cv2.imwrite(str(path), np.where(drivable, 255, 0).astype(np.uint8))
        return mask_store.open(path)

    return make


@pytest.fixture
def boxes_of():
    """Make `Boxes` at given centres (M, 3), headings (M,) and sizes (M, 3), cars unless told otherwise."""

    def make(centres, headings, sizes, categories=None, visibility=None, points=None):
        count = len(centres)
        half = np.asarray(headings, dtype=float) / 2
        turns = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=-1)
        return Boxes(
            annotation_token=tuple(f"annotation {i}" for i in range(count)),
            instance_token=tuple(f"instance {i}" for i in range(count)),
            category=tuple(categories or ["vehicle.car"] * count),
            global_from_box=pose_matrix(np.reshape(centres, (count, 3)), turns.reshape(count, 4)),
            size_wlh=np.reshape(np.asarray(sizes, dtype=float), (count, 3)),
            visibility=np.asarray(visibility if visibility is not None else [0] * count, dtype=np.uint8),
            num_lidar_pts=np.asarray(points if points is not None else [0] * count, dtype=np.int64),
        )

    return make


@pytest.fixture(scope="session")
def real_frames(real_dataroot):
    """Every key frame of the real data: the front camera's ego pose, its mask's name, and the vehicles."""
    tables = {
        name: {record["token"]: record for record in json.loads(path.read_text(encoding="utf-8"))}
        for path in (real_dataroot / "v1.0-mini").glob("*.json")
        for name in [path.stem]
    }
    category = {
        token: tables["category"][instance["category_token"]]["name"]
        for token, instance in tables["instance"].items()
    }
    vehicles = {token: [] for token in tables["sample"]}
    for annotation in tables["sample_annotation"].values():
        if category[annotation["instance_token"]].startswith("vehicle."):
            vehicles[annotation["sample_token"]].append(annotation)
    return [
        SimpleNamespace(
            pose=tables["ego_pose"][data["ego_pose_token"]], vehicles=vehicles[data["sample_token"]]
        )
        for data in tables["sample_data"].values()
        if "/CAM_FRONT/" in data["filename"] and data["is_key_frame"]
    ]
