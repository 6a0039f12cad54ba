"""A dataset whose cameras are mounted otherwise: each log's turned about its own centre, images as well."""

import json
import shutil

import cv2
import numpy as np
from pyquaternion import Quaternion

from ogmkit.base.atomic import write_json

QUALITY = 95
"""Of the images that are written."""


def write_turned(world, out, scenes, most_deg, seed):
    """Write these scenes of a synthetic world with a log each, their cameras turned.

    Args:
        world: the dataset; its images are of key frames only.
        out: where to write the dataset.
        scenes: names.
        most_deg: (pitch, roll), the greatest angles; each log's are drawn evenly up to them.
        seed: of the angles.
    """
    (version,) = (path.name for path in world.glob("v1.0-*"))
    shutil.copytree(world / "maps", out / "maps")
    shutil.copytree(world / version, out / version)
    logs = {row["log_token"] for row in _rows(world, version, "scene") if row["name"] in scenes}
    mounts = _mounts(world, version)
    random = np.random.default_rng(seed)
    turns = {mount: random.uniform(-1, 1, 2) * np.radians(most_deg) for mount in sorted(mounts.values())}
    calibrations = _rows(world, version, "calibrated_sensor")
    for row in calibrations:
        turn = _turn(*turns[row["token"]])
        row["rotation"] = list((Quaternion(row["rotation"]) * turn.inverse).elements)
    write_json(out / version / "calibrated_sensor.json", calibrations)
    intrinsics = {row["token"]: np.array(row["camera_intrinsic"]) for row in calibrations}
    wanted = {mounts[log] for log in logs}
    for row in _rows(world, version, "sample_data"):
        mount = row["calibrated_sensor_token"]
        if mount in wanted:
            matrix = intrinsics[mount]
            turned = matrix @ _turn(*turns[mount]).rotation_matrix @ np.linalg.inv(matrix)
            _write_turned(world / row["filename"], out / row["filename"], turned)


def _turn(pitch_rad, roll_rad):
    """Points in the turned camera from points in the camera: downwards about x, then clockwise about z."""
    return Quaternion(axis=(0, 0, 1), radians=-roll_rad) * Quaternion(axis=(1, 0, 0), radians=pitch_rad)


def _write_turned(source, path, matrix):
    """Pixels from outside repeat the image's edge, as in training."""
    image = cv2.imread(str(source))
    size = image.shape[1], image.shape[0]
    turned = cv2.warpPerspective(image, matrix, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), turned, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


def _mounts(world, version):
    """Log → its camera's calibration."""
    scene_of = {row["token"]: row["scene_token"] for row in _rows(world, version, "sample")}
    log_of = {row["token"]: row["log_token"] for row in _rows(world, version, "scene")}
    return {
        log_of[scene_of[row["sample_token"]]]: row["calibrated_sensor_token"]
        for row in _rows(world, version, "sample_data")
    }


def _rows(world, version, table):
    return json.loads((world / version / f"{table}.json").read_text(encoding="utf-8"))
