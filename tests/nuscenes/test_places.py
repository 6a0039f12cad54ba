"""Distances between splits and splits that lie apart, against every pair of key frames."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from ogmkit.errors import SettingsError
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.disjoint import divide_by_place
from ogmkit.nuscenes.disjoint_settings import DisjointSettings
from ogmkit.nuscenes.places import ScenePlaces, nearest_m, nearness
from ogmkit.nuscenes.split_report import report_splits


def way(name, x, y=0.0, location="here", frames=11, description=""):
    """A scene that drives 10 m along x."""
    xy = np.column_stack([np.linspace(x, x + 10, frames), np.full(frames, y)])
    return ScenePlaces(name, location, xy, description)


def shortest_m(one, other):
    if one.location != other.location:
        return np.inf
    return np.linalg.norm(one.xy_global[:, None] - other.xy_global[None], axis=-1).min()


def drawn(seed, count=40, side_m=400.0):
    """Scenes that begin anywhere, on two maps."""
    random = np.random.default_rng(seed)
    starts = random.uniform(0, side_m, (count, 2))
    return [way(f"scene-{i:04d}", x, y, "ab"[i % 2]) for i, (x, y) in enumerate(starts)]


def test_nearest_frames_are_those_of_a_tree_of_the_same_map():
    scenes = drawn(1)
    of, to = scenes[:15], scenes[15:]
    expected = []
    for scene in of:
        there = np.concatenate([other.xy_global for other in to if other.location == scene.location])
        expected.append(cKDTree(there).query(scene.xy_global)[0])

    np.testing.assert_allclose(nearest_m(of, to), np.concatenate(expected))
    assert np.isinf(nearest_m([way("one", 0.0)], [way("two", 0.0, location="there")])).all()
    assert len(nearest_m([], to)) == 0


def test_a_share_counts_frames_up_to_and_at_the_distance():
    places = {
        one.name: one for one in (way("one", 0.0), way("two", 13.0), way("lost", 0.0, location="there"))
    }
    splits = {"a": ["one"], "b": ["two", "absent"], "c": ["lost"], "d": ["absent"]}

    found = nearness("a", "b", places, splits, 5.0)  # at 13, 12 … 3 m: 3, 4 and 5 are near
    assert (found.frames, found.near_share, found.median_m) == (11, pytest.approx(3 / 11), pytest.approx(8.0))
    assert nearness("a", "c", places, splits, 5.0).near_share == 0.0
    assert math.isinf(nearness("a", "c", places, splits, 5.0).median_m)
    assert math.isnan(nearness("d", "a", places, splits, 5.0).near_share)


@given(st.integers(0, 10**6), st.sampled_from([0.0, 5.0, 20.0, 60.0]))
def test_splits_lie_apart_and_no_scene_is_lost_or_taken_twice(seed, apart_m):
    scenes = {one.name: one for one in drawn(seed)}
    found = divide_by_place(tuple(scenes.values()), DisjointSettings(apart_m, seed=seed % 7))

    names = [*found.left_out, *(name for names in found.splits.values() for name in names)]
    assert sorted(names) == sorted(scenes)
    assert all(found.splits.values())
    for split, own in found.splits.items():
        for other in found.splits.keys() - {split}:
            gaps = [shortest_m(scenes[a], scenes[b]) for a in own for b in found.splits[other]]
            assert min(gaps) > apart_m


def test_scenes_that_lie_apart_are_divided_by_the_shares():
    scenes = [way(f"scene-{i:04d}", 100.0 * i) for i in range(100)]
    found = divide_by_place(scenes, DisjointSettings())

    assert {name: len(names) for name, names in found.splits.items()} == {"train": 70, "val": 15, "test": 15}
    assert found.left_out == ()
    assert divide_by_place(scenes, DisjointSettings()) == found
    assert divide_by_place(scenes, DisjointSettings(seed=1)).splits["val"] != found.splits["val"]
    two = divide_by_place(scenes, DisjointSettings(test_share=0.0)).splits
    assert {name: len(names) for name, names in two.items()} == {"train": 85, "val": 15}


def test_one_long_road_is_cut_and_loses_the_scenes_at_the_cuts():
    scenes = [way(f"scene-{i:04d}", 10.0 * i) for i in range(100)]
    found = divide_by_place(scenes, DisjointSettings(25.0))

    sizes = {name: len(names) for name, names in found.splits.items()}
    assert 10 <= sizes["val"] <= 15
    assert 10 <= sizes["test"] <= 15
    assert 0 < len(found.left_out) <= 30
    assert sizes["train"] == 100 - sizes["val"] - sizes["test"] - len(found.left_out)


def test_what_cannot_be_divided_is_told():
    with pytest.raises(SettingsError, match=r"apart_m: 50 m leave 1 zone for 3 splits; choose less"):
        divide_by_place([way("one", 0.0)], DisjointSettings())
    with pytest.raises(SettingsError, match="together they leave nothing to train"):
        DisjointSettings(val_share=0.5, test_share=0.5)


def test_a_report_counts_what_splits_hold():
    scenes = [
        way("one", 0.0, description="Night, rain"),
        way("two", 13.0, description="Rain on a junction", frames=5),
        way("far", 0.0, location="there"),
    ]
    found = report_splits(
        scenes, {"train": ["one", "far", "absent"], "val": ["two"], "none": ["absent"]}, 5.0
    )

    train, val = found.splits
    assert (train.scenes, train.frames, train.locations) == (2, 22, {"here": 1, "there": 1})
    assert (train.tags, val.tags) == ({"night": 1, "rain": 1}, {"night": 0, "rain": 1})
    assert [(one.of, one.to) for one in found.pairs] == [("train", "val"), ("val", "train")]
    assert found.left_out == ()
    assert report_splits(scenes, {"val": ["two"]}, 5.0).left_out == ("far", "one")


def test_places_are_the_poses_of_the_tables(real_dataroot):
    with Dataset(real_dataroot) as dataset:
        places = {one.name: one for one in dataset.places()}

    folder = real_dataroot / "v1.0-mini"
    poses = {one["token"]: one["translation"] for one in json.loads((folder / "ego_pose.json").read_text())}
    samples = {one["token"]: one for one in json.loads((folder / "sample.json").read_text())}
    expected = {}
    for one in json.loads((folder / "sample_data.json").read_text()):
        if one["is_key_frame"]:
            expected.setdefault(one["sample_token"], []).append(poses[one["ego_pose_token"]][:2])
    for scene in json.loads((folder / "scene.json").read_text()):
        if scene["name"] not in places:
            continue
        own = [one["token"] for one in samples.values() if one["scene_token"] == scene["token"]]
        found = places[scene["name"]]
        assert found.description == scene["description"]
        assert len(found.xy_global) == len(own)
        # Each is one of the poses of its sample's sensors, which lie within a metre of each other.
        distances = np.linalg.norm(found.xy_global[:, None] - [expected[one][0] for one in own], axis=-1)
        assert distances.min(axis=1).max() < 1.0
    assert len(places["scene-0103"].xy_global) == 40
