"""One sample as cross_view_transformers reads it (its `nuscenes_dataset_generated`, at commit 4de6e64)."""

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from ogmkit.errors import TableError
from ogmkit.frames import FrameRecord, KeyFrame
from ogmkit.geometry.se3 import inverse
from ogmkit.labels.catalogue import PRESETS
from ogmkit.labels.centres import centre_channels
from ogmkit.labels.make import labels_of
from ogmkit.labels.plane import intrinsic_yaw_rad, plane_of
from ogmkit.nuscenes.expansion import open_expansion
from ogmkit.pipeline.exports.pictures import png_of
from ogmkit.typing import FloatArray

CVT = PRESETS["cvt"]
CAMERAS = (
    *("CAM_FRONT_LEFT", "CAM_FRONT", "CAM_FRONT_RIGHT"),
    *("CAM_BACK_LEFT", "CAM_BACK", "CAM_BACK_RIGHT"),
)
"""In the order of its `cam_ids`."""
CLASSES = tuple(one.name for one in CVT.classes if not one.unites)
"""In the order of the bits of its `bev`."""
_VIEW = ((0.0, -2.0, 100.0), (-2.0, 0.0, 100.0), (0.0, 0.0, 1.0))
"""From x, y in metres to column, row."""


def entry_of(scene: str, key_frame: KeyFrame, frames: Mapping[str, FrameRecord | None]) -> dict[str, Any]:
    """What a scene's JSON list says of a sample.

    Matrices are float64's, where the repository's own are products of float32's.

    Args:
        scene: the scene's name.
        key_frame: the sample.
        frames: camera → its frame of the sample; some of `CAMERAS`.

    Raises:
        TableError: a camera has none.
    """
    pose = _flat(key_frame.global_from_ego)
    cameras = [_frame(key_frame, frames, name) for name in CAMERAS if name in frames]
    return {
        "scene": scene,
        "token": key_frame.sample_token,
        "pose": pose.tolist(),
        "pose_inverse": inverse(pose).tolist(),
        "cam_ids": [CAMERAS.index(one.camera) for one in cameras],
        "cam_channels": [one.camera for one in cameras],
        "intrinsics": [one.intrinsics.tolist() for one in cameras],
        "extrinsics": [
            (inverse(one.ego_from_camera) @ inverse(one.global_from_ego) @ pose).tolist() for one in cameras
        ],
        "images": [one.image_path for one in cameras],
        "view": [list(row) for row in _VIEW],
        **_names(key_frame),
    }


def files_of(key_frame: KeyFrame) -> dict[str, bytes]:
    """Name → content of a sample's files: classes as bits, centres, visibility.

    Raises:
        DataFileError: the location's map expansion is absent or damaged.
    """
    arrays = labels_of(key_frame, CVT, open_expansion(key_frame.dataroot, key_frame.location))
    bits = sum(arrays[name].astype(np.uint16) << place for place, name in enumerate(CLASSES))
    file = io.BytesIO()
    np.savez_compressed(file, aux=centre_channels(key_frame.boxes, CVT, plane_of(CVT.frame, key_frame)))
    contents = {
        "bev": png_of(np.asarray(bits)),
        "aux": file.getvalue(),
        "visibility": png_of(arrays["visibility"]),
    }
    return {name: contents[kind] for kind, name in _names(key_frame).items()}


def _names(key_frame: KeyFrame) -> dict[str, str]:
    suffixes = {"bev": "png", "aux": "npz", "visibility": "png"}
    return {kind: f"{kind}_{key_frame.sample_token}.{suffix}" for kind, suffix in suffixes.items()}


def _flat(global_from_ego: FloatArray) -> FloatArray:
    """(4, 4) of the pose's position, turned about z alone, by what the repository calls yaw."""
    yaw = intrinsic_yaw_rad(global_from_ego)
    cos, sin = np.cos(yaw), np.sin(yaw)
    found = np.eye(4)
    found[:2, :2] = (cos, -sin), (sin, cos)
    found[:3, 3] = global_from_ego[:3, 3]
    return found


def _frame(key_frame: KeyFrame, frames: Mapping[str, FrameRecord | None], camera: str) -> FrameRecord:
    found = frames[camera]
    if found is None:
        raise TableError(f"sample {key_frame.sample_token}: has no frame of {camera}; leave its scene out")
    return found
