"""The committed dataset is what its script makes: tables exactly, pixels nearly."""

import hashlib
import json

import cv2
import numpy as np
import pytest
import shapely

from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import open_expansion

LEVEL_TABLES = "ad1f701e6480e2ad7aba16c99708ec90743671c0979ccb7c68f7267aa46233b3"
"""SHA-256 of the tables on which the labels in peer-labels were made, one after the other by name."""


@pytest.fixture(scope="module")
def remade(tmp_path_factory, make_fixtures):
    from ogmkit.synthetic.build import synthesize

    out = tmp_path_factory.mktemp("fixture") / "dataset"
    synthesize(out, make_fixtures.SETTINGS)
    return make_fixtures.FIXTURE, out


def names(root):
    return sorted(path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file())


def test_fixture_has_the_same_files_and_is_small(remade):
    committed, made = remade
    assert names(committed) == names(made)
    assert sum((committed / name).stat().st_size for name in names(committed)) <= 3_000_000


def test_fixture_has_the_same_tables(remade):
    committed, made = remade
    for name in names(made):
        if name.startswith("v1.0-") or name == "splits.json":
            assert json.loads((committed / name).read_text()) == json.loads((made / name).read_text()), name


def test_fixture_has_nearly_the_same_pixels(remade):
    _, made = remade
    images = [name for name in names(made) if name.endswith((".jpg", ".png"))]
    assert len(images) == 40 + 2  # of one camera in two scenes of 20 frames, and two maps
    for name in images:
        one, other = (cv2.imread(str(root / name), cv2.IMREAD_UNCHANGED) for root in remade)
        assert one.shape == other.shape
        difference = cv2.absdiff(one, other)
        assert (difference > 40).mean() < 0.005, name
        assert difference.mean() < 2.0, name


def test_fixture_has_nearly_the_same_points(remade):
    _, made = remade
    for name in names(made):
        if name.endswith(".pcd.bin"):
            one, other = (np.fromfile(root / name, dtype=np.float32) for root in remade)
            assert abs(len(one) - len(other)) <= 0.01 * len(one), name
            if len(one) == len(other):
                assert np.median(np.abs(one - other)) < 1e-3


def test_the_dataset_of_peers_labels_can_still_be_made(level_dataroot):
    digest = hashlib.sha256()
    for path in sorted((level_dataroot / "v1.0-mini").iterdir()):
        digest.update(path.read_bytes())
    assert digest.hexdigest() == LEVEL_TABLES


def test_fixture_tells_frames_and_fills_apart(make_fixtures):
    with Dataset(make_fixtures.FIXTURE) as dataset:
        frames = [
            frame for name in dataset.scene_names() for frame in dataset.key_frames(name, lidar="LIDAR_TOP")
        ]
        tilts_deg = [np.degrees(np.arccos(frame.global_from_ego[2, 2])) for frame in frames]
        categories = {name for frame in frames for name in frame.boxes.category}
    assert 1 <= min(tilts_deg) < max(tilts_deg) <= 2
    assert {"movable_object.trafficcone", "movable_object.barrier"} <= categories
    for location in ("boston-seaport", "singapore-onenorth"):
        areas = open_expansion(make_fixtures.FIXTURE, location).areas("walkway")
        rings = [shapely.Polygon(area.outer, area.holes) for area in areas]
        assert sum(not ring.is_valid for ring in rings) >= 4
        assert sum(ring.is_valid and ring.convex_hull.area > 1.2 * ring.area for ring in rings) >= 2
