"""The official devkit loads, draws and agrees with what `ogmkit synthesize` makes."""

import cv2
import matplotlib.pyplot as plt
import numpy as np
import pytest
from nuscenes.map_expansion.map_api import NuScenesMap
from nuscenes.utils.data_classes import LidarPointCloud
from nuscenes.utils.geometry_utils import view_points

POLYGON_LAYERS = ["drivable_area", "road_segment", "lane", "ped_crossing", "walkway", "carpark_area"]


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.fixture
def mended_descartes(monkeypatch):
    """The devkit draws polygons with descartes, which takes rings for arrays; since shapely 2 they aren't."""
    monkeypatch.setattr("descartes.patch.asarray", lambda ring: np.asarray(ring.coords))


@pytest.fixture(scope="module")
def maps(synthetic_world):
    """Location → (the devkit's vector map, the mask's PNG as an array)."""
    nusc = synthetic_world.nusc
    found = {}
    for log in nusc.log:
        mask = cv2.imread(str(synthetic_world.root / nusc.get("map", log["map_token"])["filename"]), 0)
        found[log["location"]] = NuScenesMap(str(synthetic_world.root), log["location"]), mask
    return found


def middle_sample(nusc):
    return nusc.sample[len(nusc.sample) // 3]


def location_of(nusc, scene):
    return nusc.get("log", scene["log_token"])["location"]


def test_tables_list_without_error(synthetic_world, capsys):
    nusc = synthetic_world.nusc
    nusc.list_categories()
    nusc.list_attributes()
    nusc.list_scenes()
    nusc.list_sample(middle_sample(nusc)["token"])
    assert "vehicle.car" in capsys.readouterr().out
    assert len({location_of(nusc, scene) for scene in nusc.scene}) == 2


def test_sample_data_of_every_sensor(synthetic_world):
    nusc = synthetic_world.nusc
    boxes_seen = 0
    for sample in nusc.sample:
        assert set(sample["data"]) == {*synthetic_world.cameras, "LIDAR_TOP"}
        for channel, token in sample["data"].items():
            path, boxes, intrinsics = nusc.get_sample_data(token)
            boxes_seen += len(boxes)
            if channel == "LIDAR_TOP":
                assert LidarPointCloud.from_file(path).nbr_points() > 0
                continue
            record = nusc.get("sample_data", token)
            assert cv2.imread(path).shape == (record["height"], record["width"], 3)
            assert intrinsics.shape == (3, 3)
    assert boxes_seen > len(nusc.sample)


def test_velocities_are_those_of_vehicles(synthetic_world):
    nusc = synthetic_world.nusc
    speeds = [np.linalg.norm(nusc.box_velocity(row["token"])[:2]) for row in nusc.sample_annotation]
    speeds = np.array(speeds)[np.isfinite(speeds)]
    assert (speeds < 0.1).any()
    assert 2 < speeds.max() < 35


@pytest.mark.parametrize("channel", ["CAM_FRONT", "CAM_BACK_RIGHT", "LIDAR_TOP"])
def test_render_sample_data(synthetic_world, channel):
    nusc = synthetic_world.nusc
    nusc.render_sample_data(middle_sample(nusc)["data"][channel], verbose=False)


def test_render_sample_and_points_in_image(synthetic_world, tmp_path):
    nusc = synthetic_world.nusc
    token = middle_sample(nusc)["token"]
    nusc.render_sample(token, out_path=str(tmp_path / "sample.png"), verbose=False)
    nusc.render_pointcloud_in_image(token, out_path=str(tmp_path / "points.png"), verbose=False)
    assert {path.name for path in tmp_path.iterdir()} == {"sample.png", "points.png"}


def test_render_annotation_and_instance(synthetic_world):
    nusc = synthetic_world.nusc
    seen = max(nusc.sample_annotation, key=lambda row: row["num_lidar_pts"])
    nusc.render_annotation(seen["token"])
    nusc.render_instance(seen["instance_token"])


def test_render_egoposes_on_map(synthetic_world):
    nusc = synthetic_world.nusc
    nusc.render_egoposes_on_map(location_of(nusc, nusc.scene[0]))


@pytest.mark.usefixtures("mended_descartes")
def test_render_vector_map(synthetic_world, maps):
    nusc = synthetic_world.nusc
    sample = middle_sample(nusc)
    scene = nusc.get("scene", sample["scene_token"])
    vector_map, _ = maps[location_of(nusc, scene)]
    x, y = ego_position(nusc, sample)
    vector_map.render_layers(POLYGON_LAYERS, figsize=3)
    vector_map.render_map_patch((x - 60, y - 60, x + 60, y + 60), POLYGON_LAYERS, figsize=(4, 4))
    vector_map.render_map_mask((x, y, 120, 120), 0, POLYGON_LAYERS, (120, 120), n_row=2)
    vector_map.render_centerlines(figsize=3)
    vector_map.render_map_in_image(nusc, sample["token"], verbose=False)
    vector_map.render_egoposes_on_fancy_map(nusc, [scene["token"]], verbose=False)
    vector_map.render_record("drivable_area", vector_map.drivable_area[0]["token"], figsize=(3, 3))


def ego_position(nusc, sample):
    image = nusc.get("sample_data", sample["data"]["CAM_FRONT"])
    return nusc.get("ego_pose", image["ego_pose_token"])["translation"][:2]


def test_ego_is_on_a_lane_that_leads_on(synthetic_world, maps):
    nusc = synthetic_world.nusc
    on_lane = leads_on = 0
    for sample in nusc.sample:
        vector_map, _ = maps[location_of(nusc, nusc.get("scene", sample["scene_token"]))]
        layers = vector_map.layers_on_point(*ego_position(nusc, sample))
        assert layers["drivable_area"]
        lane = vector_map.get_closest_lane(*ego_position(nusc, sample), radius=5)
        on_lane += bool(lane)
        leads_on += bool(lane and vector_map.get_outgoing_lane_ids(lane))
    assert on_lane == len(nusc.sample)
    assert leads_on > len(nusc.sample) / 2


def test_mask_and_vector_map_are_the_same_polygons(maps):
    touching = np.ones((5, 5), np.uint8)
    for vector_map, mask in maps.values():
        height_px, width_px = mask.shape
        height_m, width_m = height_px / 10, width_px / 10
        patch = (width_m / 2, height_m / 2, height_m, width_m)
        (drawn,) = vector_map.get_map_mask(patch, 0, ["drivable_area"], (height_px, width_px))
        drawn, stored = drawn[::-1], (mask == 255).astype(np.uint8)  # the devkit's row 0 is the southern edge
        assert np.isin(mask, (0, 255)).all()
        assert 0.005 < stored.mean() < 0.95
        # The devkit fills the outline too, from corners rounded to pixels: up to two pixels at an edge.
        assert not (stored & ~cv2.dilate(drawn, touching)).any()
        assert not (cv2.erode(drawn, touching) & ~stored).any()


def test_projected_boxes_lie_on_the_rendered_ones(synthetic_world):
    """Brightness changes most across a box's outline where the devkit projects it, not a pixel beside."""
    nusc = synthetic_world.nusc
    offsets_px = np.arange(-6, 7)
    profile = np.zeros(len(offsets_px))
    outlines = 0
    for sample in nusc.sample:
        for channel in synthetic_world.cameras:
            path, boxes, intrinsics = nusc.get_sample_data(sample["data"][channel])
            image = cv2.imread(path, cv2.IMREAD_GRAYSCALE).astype(np.float32)
            for box in boxes:
                if nusc.get("sample_annotation", box.token)["visibility_token"] != "4":
                    continue
                outline = silhouette(box, intrinsics)
                if cv2.contourArea(outline) > 400:
                    profile += changes_across(image, outline, offsets_px)
                    outlines += 1
    assert outlines > 20
    peak = np.argmax(profile)
    assert offsets_px[peak] == 0
    # A pixel off in either direction, and half of the sides would peak beside: 0.6 and more of the peak.
    assert max(profile[peak - 1], profile[peak + 1]) < 0.55 * profile[peak]


def silhouette(box, intrinsics):
    """Convex hull of the projected corners; empty where the box reaches behind the camera."""
    corners = box.corners()
    if corners[2].min() < 1:
        return np.zeros((1, 2), np.float32)
    return cv2.convexHull(view_points(corners, intrinsics, normalize=True)[:2].T.astype(np.float32))[:, 0]


def changes_across(image, outline, offsets_px):
    """(offsets,) mean brightness change along the normal, at distances outward from an outline's sides."""
    sides = np.roll(outline, -1, axis=0) - outline
    lengths = np.linalg.norm(sides, axis=1)
    total = np.zeros(len(offsets_px))
    for start, side, length in zip(outline, sides, lengths, strict=True):
        if length < 8:
            continue
        normal = np.array([side[1], -side[0]]) / length
        steps = np.linspace(0.15, 0.85, int(length))[:, None]
        points = start + steps * side
        total += [step_over(image, points + offset * normal, normal) for offset in offsets_px]
    return total


def step_over(image, points, normal):
    """Mean absolute difference between both sides of points, half a pixel away each."""
    inner, outer = (points + half * normal for half in (-0.5, 0.5))
    samples = [
        cv2.remap(
            image, side.astype(np.float32)[:, None], None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        for side in (inner, outer)
    ]
    return float(np.mean(np.abs(samples[0] - samples[1])))
