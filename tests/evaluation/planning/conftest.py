"""Shards written by plain h5py, of one curve driven twice, and planners that need no torch."""

import json
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from ogmkit.geometry.se3 import level_from_global, pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.metrics.plan import Plan
from ogmkit.shards.manifest import AMENDING, Manifest, ShardEntry, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

GRID = GridSpec(m_per_cell=0.5, rows=60, columns=40, ego_row=56, ego_column=24)
FRAMES = 15
"""Frames 6, 7 and 8 have all twelve neighbours."""
ENTRIES = {"scene-0001": ("train",), "scene-0002": ("val",), "scene-0003": ("val",)}
CAMERA = "CAM_FRONT"


@pytest.fixture
def grid():
    return GRID


@pytest.fixture
def make_shards(tmp_path):
    """Write a folder of three scenes, with homography `surface` that frame 3 lacks; returns the folder."""

    def make():
        settings = ExtractSettings(TargetSettings(grid=GRID, images="none"), (CAMERA,), "gzip")
        out = tmp_path / "shards"
        out.mkdir()
        entries = []
        for number, (scene, splits) in enumerate(ENTRIES.items()):
            with h5py.File(out / f"{scene}.h5", "w") as h5:
                attributes = {"format": "ogmkit-shard", "format_version": 1, "scene": scene}
                h5.attrs.update(attributes, settings=json.dumps(settings.to_dict()))
                _write_camera(h5.create_group(CAMERA), speed=3.0 + number)
            entries.append(ShardEntry(scene, f"{scene}.h5", "boston-seaport", FRAMES, 1, "", splits))
        write_manifest(out, Manifest("v1.0-mini", "nuscenes", settings, tuple(entries)))
        # Tests change the shards, as a command does that adds to them: the manifest doesn't know their sizes.
        (out / AMENDING).write_text('{"command": "homography-fit"}')
        return out

    return make


def _write_camera(group, speed):
    """An ego that brakes on a bend, on ground that is drivable but for a strip on the left."""
    t = np.arange(FRAMES)
    heading = 0.5 + 0.04 * t
    steps = (speed - 0.1 * t)[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    xy = np.array([300.0, 200.0]) + np.cumsum(steps, axis=0)
    zero = np.zeros(FRAMES)
    poses = pose_matrix(
        np.column_stack([xy, zero]), np.column_stack([np.cos(heading / 2), zero, zero, np.sin(heading / 2)])
    )
    group["global_from_ego"], group["level_from_global"] = poses, level_from_global(poses)
    past, future = np.full((2, FRAMES, 6, 2), np.nan)
    for now in t:
        turn = np.array(
            [[np.cos(heading[now]), -np.sin(heading[now])], [np.sin(heading[now]), np.cos(heading[now])]]
        )
        for step in range(1, 7):
            if now >= step:
                past[now, 6 - step] = (xy[now - step] - xy[now]) @ turn
            if now + step < FRAMES:
                future[now, step - 1] = (xy[now + step] - xy[now]) @ turn
    group["trajectory/past"], group["trajectory/future"] = past, future
    group["trajectory/valid"] = np.isfinite(past).all(axis=(1, 2)) & np.isfinite(future).all(axis=(1, 2))
    group["timestamp_us"] = 1_532_402_927_612_460 + 500_000 * t
    group["sample_token"] = [f"sample{i}" for i in t]
    drivable = np.ones((FRAMES, *GRID.shape), np.uint8)
    drivable[:, :, :10] = 0
    group["drivable"] = drivable
    group["homography/surface/valid"] = t != 3
    group["boxes/offsets"] = np.zeros(FRAMES + 1, np.int64)
    _write_boxes(group["boxes"], np.zeros((0, 4, 4)), ())


def _write_boxes(group, global_from_box, categories):
    count = len(global_from_box)
    for name in ("annotation_token", "instance_token"):
        group[name] = np.array([f"{name}{i}" for i in range(count)], dtype=h5py.string_dtype())
    group["category"] = np.array(categories, dtype=h5py.string_dtype())
    group["global_from_box"] = global_from_box
    group["size_wlh"] = np.tile([1.0, 2.0, 1.5], (count, 1))
    group["visibility"], group["num_lidar_pts"] = np.zeros(count, np.uint8), np.zeros(count, np.int64)


@pytest.fixture
def shards(make_shards):
    return make_shards()


@pytest.fixture
def put_boxes():
    """`put_boxes(path, frame, {category: (x, y, yaw)})`: all boxes, of one frame, by their global pose."""

    def put(path, frame, boxes):
        poses = [
            pose_matrix([x, y, 0.75], [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
            for x, y, yaw in boxes.values()
        ]
        with h5py.File(path, "r+") as h5:
            del h5[f"{CAMERA}/boxes"]
            group = h5.create_group(f"{CAMERA}/boxes")
            group["offsets"] = np.where(np.arange(FRAMES + 1) > frame, len(boxes), 0)
            _write_boxes(group, np.stack(poses), tuple(boxes))

    return put


@pytest.fixture
def driven():
    """`driven(shards, place)`: the true path of a sequence, (6, 2), by plain h5py."""

    def read(shards, place):
        scene, camera, frame = place
        with h5py.File(shards / f"{scene}.h5") as h5:
            return h5[f"{camera}/trajectory/future"][frame]

    return read


@pytest.fixture
def fake_planners(tmp_path):
    """`fake_planners(folder, name, plan, …)` makes an opened run of a planner.

    `plan(place)` gives its `Plan`; `warp` is the homography that it was trained with, None for none.
    """

    def make(folder, name="lstm-ed", plan=None, warp=None, grid=GRID, cameras=(CAMERA,), output="plan"):
        path = tmp_path / "runs" / folder
        path.mkdir(parents=True)
        standing = Plan(np.zeros((5, 2)), np.ones((5, 2)), np.zeros(5))
        calls = []

        def plans(index, homography, *, batch_size, workers):
            calls.append((homography, batch_size, workers))
            for place in map(index.place, range(len(index))):
                scene, camera, frame = place
                planned = plan(place) if plan else standing
                yield SimpleNamespace(scene=scene, camera=camera, frame=frame, plan=planned)

        return SimpleNamespace(
            step_s=0.5,
            path=path,
            checkpoint=path / "best.ckpt",
            system=name.removesuffix("-np"),
            name=name,
            output=output,
            grid=grid,
            cameras=cameras,
            warps_by=lambda homography: warp and (homography or warp),
            plans=plans,
            calls=calls,
        )

    return make
