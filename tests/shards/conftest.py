"""A small scene written by hand: two cameras, five frames, boxes, LiDAR, a map."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image

from ogmkit.frames import STEPS, Boxes, FrameRecord, LidarRecord, SceneRecord
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.target_settings import TargetSettings

FRAMES = 5
IMAGE_SIZE = (32, 48)


def quaternion(yaw_rad, pitch_rad=0.0):
    """Yaw about z after pitch about y, (w, x, y, z)."""
    (cy, sy), (cp, sp) = ((np.cos(a / 2), np.sin(a / 2)) for a in (yaw_rad, pitch_rad))
    return [cy * cp, -sy * sp, cy * sp, sy * cp]


def ego_pose(step):
    """A curve that climbs a little."""
    return pose_matrix([15 + 2.0 * step, 12 + 0.3 * step**2, 0.1 * step], quaternion(0.2 * step, 0.03))


def boxes(step):
    """`step` boxes: the first frame has none."""
    categories = ("vehicle.car", "human.pedestrian.adult", "vehicle.truck", "movable_object.barrier")[:step]
    poses = [pose_matrix([22 + 3.0 * i, 11 + 2.5 * i, 0.9], quaternion(0.4 * i)) for i in range(step)]
    return Boxes(
        annotation_token=tuple(f"annotation-{step}-{i}" for i in range(step)),
        instance_token=tuple(f"instance-{i}" for i in range(step)),
        category=categories,
        global_from_box=np.array(poses).reshape(step, 4, 4),
        size_wlh=np.array([[1.8, 4.5 + i, 1.6] for i in range(step)]).reshape(step, 3),
        visibility=np.arange(step, dtype=np.uint8),
        num_lidar_pts=np.arange(step, dtype=np.int64) * 7,
    )


def frame_record(dataroot, camera, step):
    """One frame; its files exist."""
    steps = range(step - STEPS, step + STEPS + 1)
    present = [0 <= other < FRAMES for other in steps]
    heading = {"CAM_FRONT": 0.0, "CAM_BACK": np.pi}[camera]
    # Columns: the camera's right, down and forward in the ego frame.
    to_right, forward = [np.sin(heading), -np.cos(heading), 0], [np.cos(heading), np.sin(heading), 0]
    mounting = np.eye(4)
    mounting[:3] = np.column_stack([to_right, [0, 0, -1], forward, [1.5, 0.1, 1.6]])
    return FrameRecord(
        dataroot=dataroot,
        scene_name="scene-0007",
        location="boston-seaport",
        map_path="maps/map.png",
        camera=camera,
        sample_token=f"sample-{step}",
        sample_data_token=f"{camera}-ü-{step}",
        timestamp_us=1_500_000_000_000_000 + 500_000 * step,
        image_path=f"samples/{camera}/{step}.jpg",
        image_size=IMAGE_SIZE,
        intrinsics=np.array([[30.0, 0, 23.5], [0, 30.0, 15.5], [0, 0, 1]]),
        ego_from_camera=mounting,
        global_from_ego=ego_pose(step),
        boxes=boxes(step),
        neighbour_timestamps_us=np.array(
            [1_500_000_000_000_000 + 500_000 * o if p else -1 for o, p in zip(steps, present, strict=True)]
        ),
        neighbour_positions_global=np.array(
            [ego_pose(o)[:3, 3] if p else np.full(3, np.nan) for o, p in zip(steps, present, strict=True)]
        ),
        lidar=LidarRecord(f"samples/LIDAR_TOP/{step}.pcd.bin", 0, ego_pose(step)),
    )


@pytest.fixture(scope="session")
def small_grid():
    """Off-centre and not square."""
    return GridSpec(m_per_cell=0.5, rows=60, columns=40, ego_row=50.0, ego_column=13.0)


@pytest.fixture(scope="session")
def small_settings(small_grid):
    return TargetSettings(grid=small_grid, lidar=True)


@pytest.fixture(scope="session")
def scene(tmp_path_factory):
    """The scene, with its files."""
    root = tmp_path_factory.mktemp("hand-made")
    (root / "maps").mkdir()
    drivable = np.zeros((300, 500), np.uint8)
    drivable[100:250, 80:420] = 255
    Image.fromarray(drivable).save(root / "maps/map.png")
    random = np.random.default_rng(0)
    for camera in ("CAM_FRONT", "CAM_BACK"):
        (root / "samples" / camera).mkdir(parents=True)
        for step in range(FRAMES):
            image = random.integers(0, 255, (*IMAGE_SIZE, 3), dtype=np.uint8)
            cv2.imwrite(str(root / f"samples/{camera}/{step}.jpg"), image)
    (root / "samples/LIDAR_TOP").mkdir()
    for step in range(FRAMES):
        points = random.normal(0, 10, (20 + step, 5)).astype("<f4")
        points.tofile(root / f"samples/LIDAR_TOP/{step}.pcd.bin")
    cameras = {
        camera: tuple(frame_record(root, camera, step) for step in range(FRAMES))
        for camera in ("CAM_FRONT", "CAM_BACK")
    }
    return SceneRecord("scene-0007", "boston-seaport", cameras)


@pytest.fixture(scope="session")
def masks(tmp_path_factory):
    return MaskStore(tmp_path_factory.mktemp("masks"))


@pytest.fixture(scope="session")
def broken_scene(scene):
    """The scene, with the last image of CAM_FRONT missing."""
    frames = scene.cameras["CAM_FRONT"]
    lost = replace(frames[-1], image_path="samples/CAM_FRONT/absent.jpg")
    return replace(scene, cameras={**scene.cameras, "CAM_FRONT": (*frames[:-1], lost)})
