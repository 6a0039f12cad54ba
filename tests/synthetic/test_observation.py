"""Which cameras make annotations, against rays that are cast pixel by pixel."""

import json

import numpy as np
import pytest

from ogmkit.geometry.boxes import box_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, pose_matrix, transform_points
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.clock import CAMERA_DELAYS_US
from ogmkit.synthetic.observation import camera_shares, observe
from ogmkit.synthetic.parts import split_into_parts
from ogmkit.synthetic.plan import plan_scenes
from ogmkit.synthetic.rig import CAMERA_MOUNTS, NATIVE_SIZE, scaled_intrinsics
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.synthetic.stage import build_stage

FRONT = ("CAM_FRONT",)
STEP_PX = 6


@pytest.fixture(scope="module")
def moment(town):
    (plan,) = plan_scenes(1, 6.0, 2)
    stage = build_stage(SynthesisSettings(seed=3), plan, town, 6.0)
    return stage, observe(stage, plan.start_us + 1_000_000)


def hits(global_from_part, size_wlh, origin, rays):
    """(R,) distance at which rays (R, 3) meet a box, in their lengths; infinite where they miss it."""
    part_from_global = inverse(global_from_part)
    start = part_from_global[:3, :3] @ origin + part_from_global[:3, 3]
    along = rays @ part_from_global[:3, :3].T
    half = size_wlh[[1, 0, 2]] / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(-half - start) / along, (half - start) / along])
    first, last = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    return np.where((first <= last) & (first > 0), first, np.inf)


def cast(stage, moment, channel):
    """(total, shown): for each solid how many rays of a camera's image meet it, and meet it first."""
    mount = CAMERA_MOUNTS[channel]
    ego = pose_matrix(*stage.ego_pose(moment.timestamp_us + CAMERA_DELAYS_US[channel]))
    camera = ego @ pose_matrix(mount.translation_m, mount.rotation_wxyz)
    v, u = np.mgrid[0 : NATIVE_SIZE[0] : STEP_PX, 0 : NATIVE_SIZE[1] : STEP_PX]
    pixels = np.stack([u.ravel(), v.ravel(), np.ones(u.size)], axis=-1)
    rays = pixels @ np.linalg.inv(scaled_intrinsics(channel, NATIVE_SIZE)).T @ camera[:3, :3].T
    parts = split_into_parts(moment.solids)
    distances = np.full((len(moment.solids), len(rays)), np.inf)
    for pose, size, solid in zip(parts.global_from_part, parts.size_wlh, parts.solid_index, strict=True):
        distances[solid] = np.minimum(distances[solid], hits(pose, size, camera[:3, 3], rays))
    met = np.isfinite(distances)
    first = met & (distances == distances.min(axis=0))
    return met.sum(axis=1), first.sum(axis=1)


def test_one_camera_of_six_sees_what_its_rays_meet_first(moment):
    stage, now = moment
    total, shown = cast(stage, now, "CAM_FRONT")
    front, everything = (camera_shares(stage, now, channels) for channels in (FRONT, tuple(CAMERA_MOUNTS)))

    judged = now.solids.annotated & (total > 60)
    assert judged.sum() >= 3
    np.testing.assert_allclose(front[judged], (shown / np.maximum(total, 1))[judged], atol=0.1)
    assert (total[front > 0.5] > 0).mean() > 0.9  # small ones may lie between two rays
    unseen = now.solids.annotated & (front == 0) & (everything > 0)
    assert unseen.sum() >= 3
    assert not shown[unseen].any()


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    """By the cameras that count: the tables of a world of which only CAM_FRONT is rendered, without LiDAR."""
    found = {}
    for annotate_by in ("all", "rendered"):
        root = tmp_path_factory.mktemp("world") / annotate_by
        settings = SynthesisSettings(
            *(1, 2), cameras=FRONT, image_size=(45, 80), lidar=False, annotate_by=annotate_by
        )
        synthesize(root, settings)
        folder = root / "v1.0-mini"
        found[annotate_by] = {path.stem: json.loads(path.read_text()) for path in folder.glob("*.json")}
    return found


def in_front(tables):
    """Tokens of instances that have a corner in an image."""
    records = {row["token"]: row for rows in tables.values() for row in rows}
    for row in tables["sample_data"]:
        sensor, pose = records[row["calibrated_sensor_token"]], None
        pose = next(one for one in tables["ego_pose"] if one["token"] == row["ego_pose_token"])
        camera_from_global = inverse(
            pose_matrix(pose["translation"], pose["rotation"])
            @ pose_matrix(sensor["translation"], sensor["rotation"])
        )
        for box in tables["sample_annotation"]:
            if box["sample_token"] == row["sample_token"]:
                matrix = pose_matrix(box["translation"], box["rotation"])
                corners = box_corners(matrix[None], np.array([box["size"]]))[0]
                ahead = transform_points(camera_from_global, corners)
                pixels, depth = project(np.array(sensor["camera_intrinsic"]), ahead)
                if ((depth > 0) & (np.abs(pixels - [39.5, 22]) < [41, 24]).all(axis=1)).any():
                    yield box["instance_token"]


def test_without_lidar_the_rendered_camera_alone_makes_annotations(tables):
    everything, front = ({row["token"] for row in found["instance"]} for found in tables.values())
    assert front == front & everything
    assert 0 < len(front) < len(everything)
    assert front == front & set(in_front(tables["rendered"]))
    assert everything - set(in_front(tables["all"]))
    for name in ("sample_data", "ego_pose", "calibrated_sensor", "sample"):
        assert tables["all"][name] == tables["rendered"][name]
