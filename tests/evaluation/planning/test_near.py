"""The share of reported key frames near those that are trained on, against every pair of poses."""

import json
import math

import h5py
import numpy as np
import pytest

from ogmkit.evaluation.formats import report_of
from ogmkit.evaluation.near import near_told, near_training
from ogmkit.evaluation.planning.evaluate import evaluate_plans


def positions(shards, scenes):
    found = []
    for scene in scenes:
        with h5py.File(shards / f"{scene}.h5") as h5:
            found.append(h5["CAM_FRONT/global_from_ego"][:, :2, 3])
    return np.concatenate(found)


def test_it_is_the_share_of_frames_with_a_training_frame_within_5_m(shards):
    reported, training = ("scene-0002", "scene-0003"), ("scene-0001",)
    here, there = positions(shards, reported), positions(shards, training)
    near = np.linalg.norm(here[:, None] - there, axis=-1).min(axis=1) <= 5

    assert 0.2 < near.mean() < 0.9
    assert near_training(shards, reported, training) == pytest.approx(near.mean())
    found = evaluate_plans(shards)
    assert found.near_training == pytest.approx(near.mean())
    told = f"{100 * near.mean():.1f} % of the key frames lie within 5 m of one of the scenes to learn from: "
    assert [line for line in report_of(found, all_tables=False).explanations if line.startswith(told)]


def test_maps_are_apart(shards):
    for path in shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            h5.attrs["location"] = path.stem

    assert near_training(shards, ("scene-0002",), ("scene-0001",)) == 0.0


def test_without_scenes_to_learn_from_nothing_is_told(shards, tmp_path):
    splits = tmp_path / "splits.json"
    splits.write_text(json.dumps({"val": ["scene-0002"]}))

    assert math.isnan(evaluate_plans(shards, split_file=splits).near_training)
    assert list(near_told(math.nan)) == []
