"""Labels as cross_view_transformers reads them, by its reader's rules written out here."""

import json
import re
import shutil

import numpy as np
import pytest
from PIL import Image

from ogmkit.base.execution import Execution
from ogmkit.errors import DataFileError, OutputError
from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.se3 import transform_points
from ogmkit.labels.catalogue import PRESETS
from ogmkit.labels.make import labels_of
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import open_expansion
from ogmkit.pipeline.exports.cvt import export_cvt

CLASSES = [
    *("lane", "road_segment", "road_divider", "lane_divider", "car", "truck", "bus", "trailer"),
    *("construction", "pedestrian", "motorcycle", "bicycle"),
]
SCENE = "scene-0001"
KEYS = {
    *("scene", "token", "pose", "pose_inverse", "cam_ids", "cam_channels", "intrinsics", "extrinsics"),
    *("images", "view", "bev", "aux", "visibility"),
}


@pytest.fixture(scope="module")
def labels(tmp_path_factory, tiny_dataroot):
    """Of one scene."""
    out = tmp_path_factory.mktemp("cvt") / "labels"
    with Dataset(tiny_dataroot) as dataset:
        export_cvt(dataset, out, [SCENE], splits=dataset.splits())
    return out


@pytest.fixture(scope="module")
def samples(labels):
    return json.loads((labels / f"{SCENE}.json").read_text())


@pytest.fixture(scope="module")
def key_frames(tiny_dataroot):
    with Dataset(tiny_dataroot) as dataset:
        return dataset.key_frames(SCENE, lidar="LIDAR_TOP")


def test_a_sample_says_what_the_reader_asks_for(samples, key_frames, tiny_dataroot):
    assert [one["token"] for one in samples] == [one.sample_token for one in key_frames]
    for one in samples:
        assert one.keys() == KEYS
        assert (one["cam_channels"], one["cam_ids"]) == (["CAM_FRONT", "CAM_BACK"], [1, 4])
        assert all((tiny_dataroot / path).is_file() for path in one["images"])
        assert one["view"] == [[0, -2, 100], [-2, 0, 100], [0, 0, 1]]


def test_classes_are_bits_in_the_repositorys_order(labels, samples, key_frames):
    seen = set()
    for one, key_frame in zip(samples, key_frames, strict=True):
        expansion = open_expansion(key_frame.dataroot, key_frame.location)
        expected = labels_of(key_frame, PRESETS["cvt"], expansion)
        encoded = np.array(Image.open(labels / SCENE / one["bev"]))[..., None]
        decoded = (encoded >> np.arange(12, dtype=np.int32)) & 1
        for place, name in enumerate(CLASSES):
            np.testing.assert_array_equal(decoded[..., place], expected[name])
            seen |= {name} if expected[name].any() else set()
        visibility = np.array(Image.open(labels / SCENE / one["visibility"]), dtype=np.uint8)
        np.testing.assert_array_equal(visibility, expected["visibility"])
    assert {"lane", "lane_divider", "car"} <= seen


def test_matrices_lead_from_the_flat_pose_into_each_camera(samples, key_frames, tiny_dataroot):
    with Dataset(tiny_dataroot) as dataset:
        cameras = dataset.scene(SCENE, ("CAM_FRONT", "CAM_BACK"), maps=False).cameras
    for number, (one, key_frame) in enumerate(zip(samples, key_frames, strict=True)):
        points = key_frame.boxes.global_from_box[:, :3, 3]
        flat = transform_points(np.array(one["pose_inverse"]), points)
        np.testing.assert_allclose(transform_points(np.array(one["pose"]), flat), points, atol=1e-6)
        assert np.allclose(np.array(one["pose"])[:3, 3], key_frame.global_from_ego[:3, 3])
        assert np.array(one["pose"])[2, :3].tolist() == [0, 0, 1]
        for place, camera in enumerate(one["cam_channels"]):
            frame = cameras[camera][number]
            np.testing.assert_array_equal(one["intrinsics"][place], frame.intrinsics)
            seen = transform_points(np.array(one["extrinsics"][place]), flat)
            back = transform_points(frame.global_from_ego @ frame.ego_from_camera, seen)
            np.testing.assert_allclose(back, points, atol=1e-6)


def test_centres_are_those_of_the_box_drawn_last(labels, samples, key_frames):
    one, key_frame = samples[3], key_frames[3]
    aux = np.load(labels / SCENE / one["aux"])["aux"]
    assert (aux.shape, aux.dtype) == ((200, 200, 8), np.float32)
    vehicles = np.array([name.startswith("vehicle") for name in key_frame.boxes.category])
    boxes = key_frame.boxes.selected(vehicles)
    to_cells = np.array(one["view"]) @ np.array(one["pose_inverse"])[[0, 1, 3]]
    corners = ground_corners(boxes.global_from_box, boxes.size_wlh)
    corners = np.concatenate([corners, np.ones_like(corners[..., :1])], axis=-1) @ to_cells.T
    corners = corners[..., :2]  # column, row; front right, front left, and round
    covered = np.argwhere(aux[..., 0] > 0)
    assert len(covered) > 20
    for row, column in covered[::7]:
        centres = corners.mean(axis=1)
        candidates = [np.array([column, row]) + aux[row, column, 2:4]]
        (owner,) = np.flatnonzero(np.linalg.norm(centres - candidates[0], axis=1) < 1e-3)
        centre, ahead = centres[owner], corners[owner, :2].mean(axis=0)
        aside = (corners[owner, 0] + corners[owner, 3]) / 2
        half_length, half_width = np.linalg.norm(ahead - centre), np.linalg.norm(aside - centre)
        offset = centre - [column, row]
        expected = [255, np.exp(-(offset @ offset)), *offset]
        expected += [*((ahead - centre) / (half_length + 1e-6)), half_length, half_width]
        np.testing.assert_allclose(aux[row, column], expected, atol=2e-3, rtol=1e-3)
    assert (half_length, half_width) == pytest.approx(boxes.size_wlh[owner, [1, 0]], rel=1e-3)
    assert not aux[aux[..., 0] == 0].any()
    visible = np.array(Image.open(labels / SCENE / one["visibility"])) != 255
    np.testing.assert_array_equal(aux[..., 0] > 0, visible)


def test_what_was_cut_short_goes_on_and_more_scenes_join(tmp_path, tiny_dataroot, labels, contents):
    out = tmp_path / "labels"
    with Dataset(tiny_dataroot) as dataset:
        assert export_cvt(dataset, out, [SCENE], splits=dataset.splits()).kept == 0
        (out / f"{SCENE}.json").unlink()
        (out / SCENE / "left.png").touch()
        counts = []
        execution = Execution(on_progress=lambda *told: counts.append(told))
        again = export_cvt(dataset, out, dataset.scene_names(), splits=dataset.splits(), execution=execution)
    assert (again.kept, again.rows, counts) == (0, 16, [(1, 2), (2, 2)])
    (out / SCENE / "left.png").unlink()
    assert contents(out / SCENE) == contents(labels / SCENE)
    record = json.loads((out / "export.json").read_text())
    assert [(one["file"], one["rows"], one["splits"]) for one in record["files"]] == [
        ("scene-0001.json", 8, ["train"]),
        ("scene-0002.json", 8, ["val"]),
    ]


def test_without_a_map_expansion_nothing_is_made(tmp_path, tiny_dataroot):
    left_out = shutil.ignore_patterns("expansion", "samples")
    root = shutil.copytree(tiny_dataroot, tmp_path / "dataset", ignore=left_out)
    with Dataset(root) as dataset, pytest.raises(DataFileError, match="expansion"):
        export_cvt(dataset, tmp_path / "labels", [SCENE])


def test_labels_dont_go_into_the_dataset(tiny_dataroot):
    with Dataset(tiny_dataroot) as dataset, pytest.raises(OutputError, match=re.escape("lie in one another")):
        export_cvt(dataset, tiny_dataroot / "labels", [SCENE])
