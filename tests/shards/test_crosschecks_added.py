import shutil

import h5py
import numpy as np
import pytest

from ogmkit.shards.additions import add_to_shard, new_group
from ogmkit.shards.crosschecks_added import added_problems
from ogmkit.shards.layout import create_dataset, store_dataset
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema import FOOTPRINTS, HOMOGRAPHY
from ogmkit.shards.structure import structure_problems
from ogmkit.shards.writer import write_shard

FRAMES, BOXES, MASK = 5, 10, (16, 24)
SYMBOLS = {"N": FRAMES, "M": BOXES, "height": MASK[0], "width": MASK[1]}


def homography_rows():
    """Five frames, of which the last has none, and ten boxes."""
    matrix = np.array([[1.0, 2, 3], [4, 5, 6], [7, 8, -1]])
    return {
        "bev_from_image": np.concatenate([np.tile(matrix, (4, 1, 1)), np.full((1, 3, 3), np.nan)]),
        "valid": [True] * 4 + [False],
        "reason": [""] * 4 + ["no corners"],
        "num_points": [4] * 5,
        "rms_px": [0.5, 1.0, np.inf, np.nan, np.nan],
        "rms_cells": [1.0] * 5,
        "left_out_error_m": [0.1] * 5 + [np.nan] * 4 + [np.inf],
        "left_out_refused": [False] * 5 + [True, False] * 2 + [False],
    }


def write(file):
    with file.writing() as h5:
        fit = {"method": "dlt", "settings": {"min_points": 4}, "checkpoint_sha256": ""}
        group = new_group(h5, "CAM_FRONT", HOMOGRAPHY, "dlt", fit)
        for name, rows in homography_rows().items():
            store_dataset(group, HOMOGRAPHY.field(name), rows, SYMBOLS)
        values = {"homography": "dlt", "method": "warp", "scale": 2, "settings": {"homography": fit}}
        group = new_group(h5, "CAM_FRONT", FOOTPRINTS, "dlt", values)
        for name in ("drivable", "vehicles"):
            create_dataset(group, FOOTPRINTS.field(name), SYMBOLS, "gzip")
            group[name][:4, 3:] = 1
        store_dataset(group, FOOTPRINTS.field("valid"), homography_rows()["valid"], SYMBOLS)


@pytest.fixture(scope="module")
def sound(tmp_path_factory, scene, small_settings, masks):
    path = tmp_path_factory.mktemp("sound") / "scene-0007.h5"
    write_shard(path, scene, small_settings, masks, dataset_version="v1.0-mini")
    add_to_shard(path, write)
    return path


@pytest.fixture
def problems(tmp_path, sound):
    """Problems found after an edit of CAM_FRONT's group; the structure's are told first."""

    def find(edit):
        path = shutil.copy(sound, tmp_path / sound.name)
        with h5py.File(path, "r+") as h5:
            edit(h5["CAM_FRONT"])
        with Shard(path) as shard:
            return [*structure_problems(shard)] or [*added_problems(shard, "CAM_FRONT")]

    return find


def change(name, row, value):
    def edit(front):
        data = front[name][:]
        data[row] = value
        front[name][:] = data

    return edit


def test_sound_groups_have_no_problems(problems, sound):
    assert problems(lambda front: None) == []
    with Shard(sound) as shard:
        assert shard.added("CAM_FRONT", "footprints") == ("dlt",)


def test_optional_datasets_may_be_absent(problems):
    def edit(front):
        for name in ("left_out_error_m", "left_out_refused"):
            del front["homography/dlt"][name]

    assert problems(edit) == []


CONTRADICTIONS = {
    "homography/dlt/bev_from_image contradicts valid in frame 4": change(
        "homography/dlt/bev_from_image", 4, 1.0
    ),
    "homography/dlt/bev_from_image contradicts valid in frame 1": change(
        "homography/dlt/bev_from_image", (1, 0, 0), np.nan
    ),
    "homography/dlt/bev_from_image is not of scale |h33| = 1 in frame 2": change(
        "homography/dlt/bev_from_image", (2, 2, 2), 1.1
    ),
    "homography/dlt/bev_from_image has no inverse or the wrong sign in frame 0 and 1 more": change(
        "homography/dlt/bev_from_image", [0, 2], [np.diag([1.0, 1, -1]), np.diag([0.0, 1, 1])]
    ),
    "homography/dlt/reason contradicts valid in frame 0": change("homography/dlt/reason", 0, "why"),
    "homography/dlt/reason contradicts valid in frame 4": change("homography/dlt/reason", 4, ""),
    "homography/dlt/rms_px is negative in frame 0": change("homography/dlt/rms_px", 0, -1),
    "homography/dlt/left_out_error_m is negative or contradicts left_out_refused in box 5": change(
        "homography/dlt/left_out_error_m", 5, 1.0
    ),
    "homography/dlt/left_out_error_m or left_out_refused is missing": lambda front: front.pop(
        "homography/dlt/left_out_refused"
    ),
    "footprints/dlt/drivable holds other values than 0 and 1 in frame 3": change(
        "footprints/dlt/drivable", 3, 2
    ),
    "footprints/dlt/vehicles is filled although not valid in frame 4": change(
        "footprints/dlt/vehicles", 4, 1
    ),
    "footprints/dlt/valid contradicts homography/dlt/valid in frame 4": change(
        "footprints/dlt/valid", 4, True
    ),
    "footprints/dlt/valid contradicts homography/dlt/valid in frame 0": change(
        "footprints/dlt/valid", 0, False
    ),
    "footprints/dlt/vehicles is not of the image's size / scale in frame 0 and 4 more": lambda front: front[
        "footprints/dlt"
    ].attrs.__setitem__("scale", 0.0),
    "footprints/dlt/vehicles is not of the image's size / scale in frame 3": change(
        "image_size", 3, (36, 48)
    ),
    "footprints/dlt is warped by homography 'dlt', which is not there": lambda front: front.pop(
        "homography/dlt"
    ),
    "footprints/dlt is warped by an earlier homography/dlt (homography.settings.min_points is 8 here but 4 "
    "there); run `ogmkit render-footprints` with --overwrite": lambda front: front[
        "homography/dlt"
    ].attrs.__setitem__("settings", '{"min_points": 8}'),
    "footprints/dlt is warped by an earlier homography/dlt (homography.checkpoint_sha256 is 1f here": (
        lambda front: front["homography/dlt"].attrs.__setitem__("checkpoint_sha256", "1f")
    ),
}


@pytest.mark.parametrize("message", CONTRADICTIONS)
def test_a_contradiction_is_named(problems, message):
    found = problems(CONTRADICTIONS[message])
    assert any(line.startswith(f"/CAM_FRONT/{message}") for line in found), found


def replace(name, data):
    def edit(front):
        attributes = dict(front[name].attrs)
        del front[name]
        front[name] = data
        front[name].attrs.update(attributes)

    return edit


DEPARTURES = {
    "homography/dlt/valid is missing": lambda front: front.pop("homography/dlt/valid"),
    "homography/dlt attribute method is missing": lambda front: front["homography/dlt"].attrs.pop("method"),
    "homography/dlt/extra is not in the schema": lambda front: front.create_dataset(
        "homography/dlt/extra", data=1
    ),
    "homography/alone is not in the schema": lambda front: front.create_dataset("homography/alone", data=1),
    "homography/dlt/left_out_error_m has shape (9,), not (10,)": replace(
        "homography/dlt/left_out_error_m", np.zeros(9)
    ),
    "homography/dlt/valid has dtype int64, not bool": replace("homography/dlt/valid", np.zeros(5, np.int64)),
    "footprints/dlt/vehicles has shape (5, 16, 23), not (5, 16, 24)": replace(
        "footprints/dlt/vehicles", np.zeros((5, 16, 23), np.uint8)
    ),
    "footprints/dlt attribute scale is '2', not a float": lambda front: front[
        "footprints/dlt"
    ].attrs.__setitem__("scale", "2"),
}


@pytest.mark.parametrize("message", DEPARTURES)
def test_a_departure_from_the_schema_is_named(problems, message):
    assert f"/CAM_FRONT/{message}" in problems(DEPARTURES[message])
