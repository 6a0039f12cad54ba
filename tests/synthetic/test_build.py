import json
from collections import Counter
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
import shapely
from filelock import FileLock
from shapely import Point, Polygon

from ogmkit.errors import OutputError, SettingsError
from ogmkit.geometry.boxes import box_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, pose_matrix, transform_points
from ogmkit.synthetic import plan
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.plan import plan_scenes, split_scenes
from ogmkit.synthetic.settings import SynthesisSettings

TINY = {"cameras": ("CAM_FRONT",), "image_size": (45, 80), "lidar_azimuths": 60, "frames": 2, "scenes": 1}


def tables(root):
    (folder,) = root.glob("v1.0-*")
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in folder.glob("*.json")}


@pytest.fixture(scope="module")
def rows(tiny_dataroot):
    return tables(tiny_dataroot)


@pytest.fixture(scope="module")
def by_token(rows):
    return {name: {row["token"]: row for row in table} for name, table in rows.items()}


def contents(root):
    return {
        path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()
    }


def test_thirteen_tables_with_unique_tokens(rows, by_token):
    assert len(rows) == 13
    for name, table in rows.items():
        assert table, name
        assert len(by_token[name]) == len(table)


def test_every_reference_leads_somewhere(rows, by_token):
    for name, table in rows.items():
        for row in table:
            for column, value in row.items():
                if column in ("prev", "next"):
                    assert value == "" or value in by_token[name]
                elif column.endswith("_tokens"):
                    assert set(value) <= by_token[column.removesuffix("_tokens")].keys()
                elif column.endswith("_token"):
                    kind = column.removesuffix("_token").removeprefix("first_").removeprefix("last_")
                    kind = {"annotation": "sample_annotation"}.get(kind, kind)
                    assert value in by_token[kind]


@pytest.mark.parametrize("name", ["sample", "sample_data", "sample_annotation"])
def test_chains_go_both_ways_and_forward_in_time(name, rows, by_token):
    def time(row):
        return (
            row["timestamp"] if "timestamp" in row else by_token["sample"][row["sample_token"]]["timestamp"]
        )

    for row in rows[name]:
        if row["next"]:
            following = by_token[name][row["next"]]
            assert following["prev"] == row["token"]
            assert time(following) > time(row)
    starts = sum(not row["prev"] for row in rows[name])
    assert starts == sum(not row["next"] for row in rows[name])
    assert starts == {"sample": 2, "sample_data": 6}.get(name, len(rows["instance"]))


def test_instances_count_their_annotations(rows):
    counted = Counter(row["instance_token"] for row in rows["sample_annotation"])
    assert {row["token"]: row["nbr_annotations"] for row in rows["instance"]} == counted


def test_all_files_of_the_tables_exist_with_the_size_they_tell(tiny_dataroot, rows):
    for row in rows["sample_data"]:
        path = tiny_dataroot / row["filename"]
        if row["fileformat"] == "jpg":
            assert cv2.imread(str(path)).shape == (row["height"], row["width"], 3)
        else:
            assert np.fromfile(path, dtype=np.float32).reshape(-1, 5).shape[0] > 100
    named = {row["filename"] for row in rows["sample_data"]}
    found = {path.relative_to(tiny_dataroot).as_posix() for path in tiny_dataroot.glob("samples/*/*")}
    assert found == named


def test_ego_is_on_the_mask_and_on_the_ground(tiny_dataroot, rows, by_token):
    masks = {
        log: cv2.imread(str(tiny_dataroot / row["filename"]), cv2.IMREAD_UNCHANGED)
        for row in rows["map"]
        for log in row["log_tokens"]
    }
    for row in rows["sample_data"]:
        pose = by_token["ego_pose"][row["ego_pose_token"]]
        scene = by_token["scene"][by_token["sample"][row["sample_token"]]["scene_token"]]
        mask = masks[scene["log_token"]]
        x, y, z = pose["translation"]
        assert mask.dtype == np.uint8
        assert mask[round(mask.shape[0] - 10 * y), round(10 * x)] == 255
        assert z == 0.0
        assert np.linalg.norm(pose["rotation"]) == pytest.approx(1.0, abs=2e-8)


def test_mask_and_map_expansion_describe_the_same_polygons(tiny_dataroot, rows):
    for row in rows["map"]:
        log = next(log for log in rows["log"] if log["token"] in row["log_tokens"])
        mask = cv2.imread(str(tiny_dataroot / row["filename"]), cv2.IMREAD_UNCHANGED)
        expansion = json.loads((tiny_dataroot / f"maps/expansion/{log['location']}.json").read_text())
        assert expansion["version"] == "1.3"
        assert expansion["canvas_edge"] == [mask.shape[1] / 10, mask.shape[0] / 10]
        drivable = shapely.union_all(
            [polygon_of(expansion, token) for token in expansion["drivable_area"][0]["polygon_tokens"]]
        )
        rows_px, columns_px = np.random.default_rng(0).integers(0, mask.shape, (20000, 2)).T
        inside = shapely.contains_xy(drivable, columns_px / 10, (mask.shape[0] - rows_px) / 10)
        assert np.array_equal(mask[rows_px, columns_px] == 255, inside)


def polygon_of(expansion, token):
    nodes = {node["token"]: (node["x"], node["y"]) for node in expansion["node"]}
    polygon = next(row for row in expansion["polygon"] if row["token"] == token)
    holes = [[nodes[node] for node in hole["node_tokens"]] for hole in polygon["holes"]]
    return Polygon([nodes[node] for node in polygon["exterior_node_tokens"]], holes)


def test_map_expansion_has_all_layers_and_no_dangling_tokens(tiny_dataroot):
    layers = "drivable_area road_segment road_block lane lane_connector ped_crossing walkway stop_line"
    layers += " carpark_area road_divider lane_divider traffic_light arcline_path_3 connectivity"
    for path in (tiny_dataroot / "maps" / "expansion").iterdir():
        expansion = json.loads(path.read_text())
        assert all(expansion[layer] for layer in layers.split())
        tokens = {
            layer: {row["token"] for row in table}
            for layer, table in expansion.items()
            if isinstance(table, list) and isinstance(table[0], dict)
        }
        for layer, table in expansion.items():
            for row in table if layer in tokens else ():
                for column, value in row.items():
                    kind = column.removesuffix("_token").removesuffix("_edge_line") if value else ""
                    kind = {"from": "line", "to": "line", "from_road_block": "road_block"}.get(kind, kind)
                    if kind != column and kind:
                        assert value in tokens[kind], (layer, column)
        lanes = tokens["lane"] | tokens["lane_connector"]
        assert set(expansion["arcline_path_3"]) == set(expansion["connectivity"]) == lanes
        for lane in expansion["lane"]:
            middle = expansion["arcline_path_3"][lane["token"]][1]["start_pose"]
            assert polygon_of(expansion, lane["polygon_token"]).contains(Point(middle[:2]))


def test_boxes_lie_where_the_image_shows_them(tmp_path):
    root = tmp_path / "out"
    settings = {**TINY, "image_size": (450, 800), "frames": 3, "lidar": False}
    synthesize(root, SynthesisSettings(**settings))
    found = tables(root)
    records = {row["token"]: row for table in found.values() for row in table}
    contrasts = []
    for row in found["sample_data"]:
        image = cv2.imread(str(root / row["filename"])).astype(float)
        sensor, pose = records[row["calibrated_sensor_token"]], found["ego_pose"]
        pose = next(pose_row for pose_row in pose if pose_row["token"] == row["ego_pose_token"])
        global_from_ego = pose_matrix(pose["translation"], pose["rotation"])
        ego_from_camera = pose_matrix(sensor["translation"], sensor["rotation"])
        camera_from_global = inverse(global_from_ego @ ego_from_camera)
        for box in found["sample_annotation"]:
            if box["sample_token"] != row["sample_token"] or box["visibility_token"] != "4":
                continue
            matrix = pose_matrix(box["translation"], box["rotation"])
            corners = box_corners(matrix[None], np.array([box["size"]]))[0]
            pixels, depth = project(
                np.array(sensor["camera_intrinsic"]), transform_points(camera_from_global, corners)
            )
            hull = cv2.convexHull(np.round(pixels).astype(np.int32))
            if depth.min() < 1 or pixels.min() < 8 or (pixels.max(0) > (791, 441)).any() or len(hull) < 4:
                continue
            inside = cv2.fillConvexPoly(np.zeros((450, 800), np.uint8), hull, 1)
            if inside.sum() > 1500:
                rim = cv2.dilate(inside, np.ones((7, 7))) - cv2.dilate(inside, np.ones((3, 3)))
                core = inside - cv2.erode(inside, np.ones((5, 5)))
                contrasts.append(np.abs(image[rim > 0].mean(0) - image[core > 0].mean(0)).max())
    assert len(contrasts) >= 2
    assert np.median(contrasts) > 10


def test_annotations_know_what_was_seen(rows):
    seen = [row for row in rows["sample_annotation"] if row["num_lidar_pts"] > 0]
    assert len(seen) > len(rows["sample_annotation"]) / 3
    levels = Counter(row["visibility_token"] for row in rows["sample_annotation"])
    assert set(levels) == {"1", "2", "3", "4"}
    points = {
        level: np.mean(
            [row["num_lidar_pts"] for row in rows["sample_annotation"] if row["visibility_token"] == level]
        )
        for level in "14"
    }
    assert points["4"] > points["1"]


def test_lidar_points_are_counted_in_the_boxes(tiny_dataroot, rows, by_token):
    row = next(row for row in rows["sample_data"] if row["fileformat"] == "pcd")
    points = np.fromfile(tiny_dataroot / row["filename"], dtype=np.float32).reshape(-1, 5)[:, :3]
    pose, sensor = by_token["ego_pose"][row["ego_pose_token"]], row["calibrated_sensor_token"]
    sensor = by_token["calibrated_sensor"][sensor]
    matrix = pose_matrix(pose["translation"], pose["rotation"])
    points = transform_points(matrix @ pose_matrix(sensor["translation"], sensor["rotation"]), points)
    differences = []
    for box in rows["sample_annotation"]:
        if box["sample_token"] == row["sample_token"] and box["num_lidar_pts"] > 3:
            local = transform_points(inverse(pose_matrix(box["translation"], box["rotation"])), points)
            half = np.array(box["size"])[[1, 0, 2]] / 2 + 0.01
            differences.append((np.abs(local) <= half).all(1).sum() - box["num_lidar_pts"])
    assert len(differences) > 3
    assert np.median(np.abs(differences)) <= 1


@pytest.mark.slow
def test_same_settings_give_the_same_bytes_and_another_seed_other_ones(tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        synthesize(tmp_path / name, SynthesisSettings(**TINY, seed=seed))
    assert contents(tmp_path / "a") == contents(tmp_path / "b")
    assert not contents(tmp_path / "a").keys() & {
        name for name in contents(tmp_path / "c") if name.startswith("samples")
    }


def test_sweeps_relief_and_no_lidar(tmp_path):
    settings = SynthesisSettings(**TINY, relief_m=5.0, lidar=False, sweeps=True)
    summary = synthesize(tmp_path / "out", settings)
    found = tables(tmp_path / "out")
    assert summary.files == len(found["sample_data"]) == 7
    assert [row["is_key_frame"] for row in found["sample_data"]] == [True, *[False] * 5, True]
    assert {row["filename"].split("/")[0] for row in found["sample_data"]} == {"samples", "sweeps"}
    assert all(row["num_lidar_pts"] == 0 for row in found["sample_annotation"])
    heights = np.array([row["translation"][2] for row in found["ego_pose"]])
    assert np.all(heights != 0.0)
    assert all(pair[0]["timestamp"] < pair[1]["timestamp"] for pair in pairwise(found["ego_pose"]))
    assert any(abs(row["rotation"][2]) > 1e-4 for row in found["ego_pose"])


def test_progress_ends_at_the_number_of_files(tmp_path):
    told = []
    summary = synthesize(
        tmp_path / "out",
        SynthesisSettings(**TINY),
        on_progress=lambda done, total: told.append((done, total)),
    )
    assert told == [(done, summary.files) for done in range(1, summary.files + 1)]


def test_a_folder_that_holds_something_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(OutputError, match="not an empty folder"):
        synthesize(tmp_path, SynthesisSettings(**TINY))
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_the_current_folder_is_refused_before_any_work(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OutputError, match="is the current folder"):
        synthesize(Path(), SynthesisSettings(**TINY))
    assert list(tmp_path.iterdir()) == []


def test_a_failed_run_leaves_nothing_behind(tmp_path):
    def fail(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        synthesize(tmp_path / "out", SynthesisSettings(**TINY), on_progress=fail)
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path):
    left = tmp_path / ".out.making" / "dataset" / "samples"
    left.mkdir(parents=True)
    (left / "half.jpg").write_bytes(b"half")
    synthesize(tmp_path / "out", SynthesisSettings(**TINY))
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert not list((tmp_path / "out").rglob("half.jpg"))


def test_two_runs_don_t_make_the_same_dataset_at_once(tmp_path):
    (tmp_path / ".out.making").mkdir()
    with (
        FileLock(tmp_path / ".out.making" / "lock"),
        pytest.raises(OutputError, match="another run is making it; wait for it"),
    ):
        synthesize(tmp_path / "out", SynthesisSettings(**TINY))


@pytest.mark.parametrize(
    "wrong",
    [
        {"scenes": 0},
        {"frames": 0},
        {"seed": -1},
        {"version": "../v1.0-mini"},
        {"version": "mini"},
        {"cameras": ()},
        {"cameras": ("CAM_FRONT", "CAM_FRONT")},
        {"cameras": ("CAM_TOP",)},
        {"image_size": (0, 80)},
        {"relief_m": -1.0},
        {"relief_m": float("nan")},
        {"lidar_azimuths": 0},
    ],
)
def test_wrong_settings_are_refused(wrong):
    with pytest.raises(SettingsError, match=r"^[a-z_]+: "):
        SynthesisSettings(**wrong)


@pytest.mark.parametrize("count", range(1, 30))
def test_splits_cover_all_scenes_once_and_leave_none_empty(count):
    names = [f"scene-{number}" for number in range(count)]
    splits = split_scenes(names)
    assert sorted(name for part in splits.values() for name in part) == sorted(names)
    assert splits["train"]
    assert bool(splits["val"]) == (count > 1)
    assert ("test" in splits) == (count >= 6)
    assert all(splits[part] for part in splits if part == "test")


def test_scenes_spread_over_locations_and_logs_without_overlap_in_time():
    scenes = plan_scenes(20, 13.0, 2)
    assert len({scene.log.location.name for scene in scenes[:4]}) == 4
    by_log = Counter(scene.log for scene in scenes)
    assert len(by_log) == 12
    assert max(by_log.values()) == 2
    starts = sorted(scene.start_us for scene in scenes)
    assert min(b - a for a, b in pairwise(starts)) > 13e6


@pytest.mark.parametrize(("scenes_per_log", "logs"), [(1, 20), (2, 12), (5, 4)])
def test_a_log_has_at_most_so_many_scenes_of_its_location(scenes_per_log, logs):
    by_log = Counter(scene.log for scene in plan_scenes(20, 13.0, scenes_per_log))
    assert (len(by_log), max(by_log.values())) == (logs, scenes_per_log)
    assert len({log.name for log in by_log}) == logs


def test_each_scene_may_have_a_log_and_on_hills_a_calibration_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(plan, "LOCATIONS", plan.LOCATIONS[:1])  # one map is enough here
    settings = {**TINY, "scenes": 3, "frames": 1, "lidar": False, "relief_m": 2.0, "scenes_per_log": 1}
    synthesize(tmp_path / "out", SynthesisSettings(**settings))
    found = tables(tmp_path / "out")

    assert len(found["log"]) == len({row["log_token"] for row in found["scene"]}) == 3
    mountings = {(*row["translation"], *row["rotation"]) for row in found["calibrated_sensor"]}
    assert len(mountings) == len(found["calibrated_sensor"]) == 3
