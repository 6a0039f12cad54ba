"""A dataset written by hand: small, sound, every token readable, files in place."""

import itertools
import json
import struct
import zlib

import cv2
import numpy as np
import pytest

CHANNELS = {"CAM_FRONT": "camera", "CAM_BACK": "camera", "LIDAR_TOP": "lidar", "RADAR_FRONT": "radar"}
FRAMES = {1: 8, 2: 3}
INTRINSIC = [[20.0, 0.0, 15.5], [0.0, 20.0, 8.5], [0.0, 0.0, 1.0]]
START_US = 1_500_000_000_000_000


def _tables():
    """Two scenes: log-1 with 8 key frames, log-2 with 3; one sweep of CAM_FRONT after each key frame."""
    tables = {
        "log": [
            {"token": f"log-{s}", "logfile": "", "vehicle": "", "date_captured": "", "location": location}
            for s, location in ((1, "boston-seaport"), (2, "singapore-onenorth"))
        ],
        "map": [
            {"token": f"map-{s}", "filename": f"maps/{s}.png", "log_tokens": [f"log-{s}"], "category": ""}
            for s in FRAMES
        ],
        "sensor": [{"token": f"sensor-{c}", "channel": c, "modality": m} for c, m in CHANNELS.items()],
        "category": [
            {"token": f"category-{name}", "name": name, "description": ""}
            for name in ("vehicle.car", "human.pedestrian.adult")
        ],
        "attribute": [{"token": "attribute-1", "name": "vehicle.moving", "description": ""}],
        "visibility": [
            {"token": str(i), "level": level, "description": ""}
            for i, level in enumerate(("v0-40", "v40-60", "v60-80", "v80-100"), 1)
        ],
    }
    names = (
        "scene",
        "sample",
        "calibrated_sensor",
        "sample_data",
        "ego_pose",
        "instance",
        "sample_annotation",
    )
    tables.update({name: [] for name in names})
    for s, count in FRAMES.items():
        _add_scene(tables, s, count)
    return tables


def _add_scene(tables, s, count):
    samples = [f"sample-{s}-{i}" for i in range(count)]
    tables["scene"].append(
        {
            "token": f"scene-{s}",
            "name": f"scene-000{s}",
            "description": "",
            "log_token": f"log-{s}",
            "nbr_samples": count,
            "first_sample_token": samples[0],
            "last_sample_token": samples[-1],
        }
    )
    for c, channel in enumerate(CHANNELS):
        tables["calibrated_sensor"].append(
            {
                "token": f"calibration-{s}-{channel}",
                "sensor_token": f"sensor-{channel}",
                "translation": [1.0 + c, 0.1 * c, 1.5],
                "rotation": [0.5, -0.5, 0.5, -0.5] if c % 2 else [0.8, 0.0, 0.0, 0.6],
                "camera_intrinsic": INTRINSIC if channel.startswith("CAM") else [],
            }
        )
    for i, sample in enumerate(samples):
        tables["sample"].append(
            {
                "token": sample,
                "timestamp": START_US + 500_000 * i,
                "prev": samples[i - 1] if i else "",
                "next": samples[i + 1] if i + 1 < count else "",
                "scene_token": f"scene-{s}",
            }
        )
        for c, channel in enumerate(CHANNELS):
            _add_data(tables, s, i, c, channel, is_key_frame=True)
        _add_data(tables, s, i, 0, "CAM_FRONT", is_key_frame=False)
    _link(tables["sample_data"], "calibrated_sensor_token")
    for kind in ("vehicle.car", "human.pedestrian.adult"):
        _add_track(tables, s, kind, samples)


def _add_data(tables, s, i, c, channel, *, is_key_frame):
    kind = "samples" if is_key_frame else "sweeps"
    token = f"{kind}-{s}-{i}-{channel}"
    camera = channel.startswith("CAM")
    timestamp = START_US + 500_000 * i + 1000 * c + (0 if is_key_frame else 250_000)
    yaw = 0.1 * i + 0.01 * c
    tables["ego_pose"].append(
        {
            "token": f"pose-{token}",
            "timestamp": timestamp,
            "translation": [10.0 + 2.0 * i + 0.01 * c, 20.0 + 0.3 * i, 0.0],
            "rotation": [float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2))],
        }
    )
    tables["sample_data"].append(
        {
            "token": token,
            "sample_token": f"sample-{s}-{i}",
            "ego_pose_token": f"pose-{token}",
            "calibrated_sensor_token": f"calibration-{s}-{channel}",
            "timestamp": timestamp,
            "fileformat": "jpg" if camera else "pcd",
            "is_key_frame": is_key_frame,
            "height": 18 if camera else 0,
            "width": 32 if camera else 0,
            "filename": f"{kind}/{channel}/{s}-{i}.{'jpg' if camera else 'bin'}",
            "prev": "",
            "next": "",
        }
    )


def _add_track(tables, s, kind, samples):
    instance = f"instance-{s}-{kind}"
    first = len(tables["sample_annotation"])
    for i, sample in enumerate(samples):
        tables["sample_annotation"].append(
            {
                "token": f"annotation-{s}-{i}-{kind}",
                "sample_token": sample,
                "instance_token": instance,
                "visibility_token": str(i % 5) if i % 5 else "",
                "attribute_tokens": ["attribute-1"] if kind == "vehicle.car" else [],
                "translation": [30.0 + i, 25.0, 0.8],
                "size": [1.9, 4.5, 1.6],
                "rotation": [0.6, 0.0, 0.0, 0.8],
                "prev": "",
                "next": "",
                "num_lidar_pts": 3 * i,
                "num_radar_pts": 0,
            }
        )
    track = tables["sample_annotation"][first:]
    _link(track, "instance_token")
    tables["instance"].append(
        {
            "token": instance,
            "category_token": f"category-{kind}",
            "nbr_annotations": len(track),
            "first_annotation_token": track[0]["token"],
            "last_annotation_token": track[-1]["token"],
        }
    )


def _link(rows, key):
    """Chain rows of the same `key` in their order."""
    chains = {}
    for row in rows:
        chains.setdefault(row[key], []).append(row)
    for chain in chains.values():
        for before, after in itertools.pairwise(chain):
            before["next"], after["prev"] = after["token"], before["token"]


def _grey_png(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    pixels = zlib.compress((b"\0" + b"\xff" * width) * height)
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


@pytest.fixture(scope="session")
def make_dataset():
    """`make_dataset(root)` writes the dataset with all its files."""
    jpeg = cv2.imencode(".jpg", np.zeros((18, 32, 3), np.uint8))[1].tobytes()

    def make(root):
        tables = _tables()
        (root / "v1.0-small").mkdir(parents=True)
        for name, rows in tables.items():
            (root / "v1.0-small" / f"{name}.json").write_text(json.dumps(rows), encoding="utf-8")
        for row in tables["sample_data"]:
            path = root / row["filename"]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(jpeg if row["fileformat"] == "jpg" else bytes(40))
        (root / "maps").mkdir()
        for row in tables["map"]:
            (root / row["filename"]).write_bytes(_grey_png(500, 400))
        return root

    return make


@pytest.fixture
def small_root(make_dataset, tmp_path):
    """The dataset, free to be changed."""
    return make_dataset(tmp_path / "data")


@pytest.fixture
def damage(small_root, edit_table):
    """`damage(table, token, **values)` changes one record of `small_root`; None deletes a key."""

    def change(table, token, **values):
        def edit(records):
            (record,) = (record for record in records if record["token"] == token)
            for key, value in values.items():
                if value is None:
                    del record[key]
                else:
                    record[key] = value

        return edit_table(small_root, table, edit)

    return change
