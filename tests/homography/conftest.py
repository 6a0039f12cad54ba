"""Frames with a front camera over a ground of one's choice, and real ones."""

import json

import numpy as np
import pytest

from ogmkit.geometry.se3 import level_from_global, pose_matrix, transform_points
from ogmkit.homography.frame import FrameGeometry

INTRINSICS = np.array([[1266.0, 0.0, 816.0], [0.0, 1266.0, 491.0], [0.0, 0.0, 1.0]])
FRONT = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
CARS = ((9.0, 1.5), (14.0, -4.0), (21.0, 3.5), (28.0, -3.0), (36.0, 6.0), (47.0, -7.0))


def flat(points_m):
    return np.zeros(points_m.shape[:-1])


@pytest.fixture
def make_frame():
    """`make_frame(places, ground, heading_rad=…, …)`: cars on a ground height function before a camera.

    The camera looks along x, 1.5 m up, then everything but the ground's heights is turned by the heading.
    """

    def make(
        places=CARS, ground=flat, *, heading_rad=0.0, raised_m=0.0, yaw_rad=0.3, size=(1.9, 4.5, 1.6), **more
    ):
        turned = pose_matrix([0, 0, 0], [np.cos(heading_rad / 2), 0, 0, np.sin(heading_rad / 2)])
        places = transform_points(turned, np.array([(x, y, 0.0) for x, y in places]).reshape(-1, 3))
        places[:, 2] = ground(places[:, :2]) + raised_m + size[2] / 2
        rotation = [np.cos(yaw_rad / 2), 0, 0, np.sin(yaw_rad / 2)]
        camera = np.eye(4)
        camera[:3, :3], camera[:3, 3] = FRONT, (1.7, 0.0, 1.5)
        fields = {
            "intrinsics": INTRINSICS,
            "level_from_camera": turned @ camera,
            "level_from_ego": turned,
            "image_size": (900, 1600),
            "level_from_box": pose_matrix(places, np.tile(rotation, (len(places), 1))),
            "size_wlh": np.tile(size, (len(places), 1)).astype(float).reshape(-1, 3),
            "category": ("vehicle.car",) * len(places),
            "visibility": np.full(len(places), 4, dtype=np.uint8),
            "num_lidar_pts": np.full(len(places), 9),
        }
        return FrameGeometry(**{**fields, **more})

    return make


@pytest.fixture(scope="session")
def real_frames(real_dataroot):
    """scene name → `FrameGeometry` of each key frame of CAM_FRONT, straight from the JSON tables."""
    tables = {
        path.stem: {record["token"]: record for record in json.loads(path.read_text(encoding="utf-8"))}
        for path in (real_dataroot / "v1.0-mini").glob("*.json")
    }
    annotations = {}
    for record in tables["sample_annotation"].values():
        annotations.setdefault(record["sample_token"], []).append(record)
    frames = {}
    for image in sorted(tables["sample_data"].values(), key=lambda record: record["timestamp"]):
        mount = tables["calibrated_sensor"][image["calibrated_sensor_token"]]
        if not image["is_key_frame"] or tables["sensor"][mount["sensor_token"]]["channel"] != "CAM_FRONT":
            continue
        scene = tables["scene"][tables["sample"][image["sample_token"]]["scene_token"]]["name"]
        frames.setdefault(scene, []).append(
            real_frame(tables, image, mount, annotations.get(image["sample_token"], []))
        )
    return frames


def real_frame(tables, image, mount, annotations):
    pose = tables["ego_pose"][image["ego_pose_token"]]
    global_from_ego = pose_matrix(pose["translation"], pose["rotation"])
    to_level = level_from_global(global_from_ego)
    ego_from_camera = pose_matrix(mount["translation"], mount["rotation"])
    instances = [tables["instance"][record["instance_token"]] for record in annotations]
    poses = pose_matrix(
        np.array([record["translation"] for record in annotations]).reshape(-1, 3),
        np.array([record["rotation"] for record in annotations]).reshape(-1, 4),
    )
    return FrameGeometry(
        intrinsics=np.array(mount["camera_intrinsic"]),
        level_from_camera=to_level @ global_from_ego @ ego_from_camera,
        level_from_ego=to_level @ global_from_ego,
        image_size=(image["height"], image["width"]),
        level_from_box=to_level @ poses,
        size_wlh=np.array([record["size"] for record in annotations]).reshape(-1, 3),
        category=tuple(tables["category"][instance["category_token"]]["name"] for instance in instances),
        visibility=np.array([int(record["visibility_token"] or 0) for record in annotations], dtype=np.uint8),
        num_lidar_pts=np.array([record["num_lidar_pts"] for record in annotations], dtype=np.int64),
    )
