import json
import shutil

import h5py
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

from ogmkit.grid import GridSpec
from ogmkit.shards.reader import Shard

GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
FIRST_SEQUENCE = range(1, 7)
"""Frames of a scene's first sequence with a valid trajectory."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory, make_run):
    """System → RUN."""
    folder = tmp_path_factory.mktemp("runs")
    systems = {"lstm-ed": {}, "mid-to-end": {}, "holistic": {"warp": "surface"}, "ved": {"bev_cell_m": 1.0}}
    return {
        system: make_run(folder / system, system, GRID, ("CAM_FRONT",), **more)
        for system, more in systems.items()
    }


@pytest.fixture
def images(tmp_path, plan_shards):
    """Six images, and `plan.json` beside the folder."""
    folder = tmp_path / "images"
    folder.mkdir()
    with Shard(plan_shards / "scene-0001.h5") as shard:
        for frame in FIRST_SEQUENCE:
            (folder / f"{frame}.jpg").write_bytes(shard.image("CAM_FRONT", frame).tobytes())
        matrix = shard.dataset("CAM_FRONT", "homography/surface/bev_from_image")[0]
    known = {
        "image_size": [90, 160],
        "bev_from_image": matrix.tolist(),
        "positions": [[-5 + i, 0] for i in range(6)],
        "destination": [6, 0.5],
    }
    (tmp_path / "plan.json").write_text(json.dumps(known))
    return folder


def run(*arguments):
    return CliRunner().invoke(main, ["predict", "plan", *map(str, arguments)])


def test_plans_of_shards_go_to_stdout_and_nothing_else(plan_shards, runs, complaints):
    result = run(plan_shards, "--checkpoint", runs["holistic"], "--split", "val", "--samples", "3")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    found = json.loads(result.stdout)
    assert [(one["scene"], one["frame"]) for one in found] == [
        ("scene-0002", frame) for frame in range(6, 10)
    ]
    assert len(result.stdout.splitlines()) == 4
    for one in found:
        assert len(one["plan"]) == 5
        assert [len(points) for points in one["samples"]] == [5, 5, 5]


def test_a_file_gets_what_stdout_would(tmp_path, plan_shards, runs, complaints):
    options = [plan_shards, "--checkpoint", runs["holistic"], "--limit-frames", "2", "--samples", "1"]
    path = tmp_path / "plans.json"
    path.write_text("old")
    result = run(*options, "--seed", "4", "--out", path)
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    assert result.stdout == f"{path}: holistic warped by surface, 2 plans\n"
    assert path.read_text() == run(*options, "--seed", "4").stdout
    assert path.read_text() != run(*options, "--seed", "5").stdout
    assert list(tmp_path.iterdir()) == [path]


def test_six_images_give_a_list_of_one(images, runs, complaints):
    result = run(images, "--checkpoint", runs["holistic"], "--calibration", images.with_name("plan.json"))
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    (one,) = json.loads(result.stdout)
    assert one["files"] == [f"{frame}.jpg" for frame in FIRST_SEQUENCE]
    assert one["destination"] == [6.0, 0.5]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--calibration", "--split", "val"], "--split goes with shards"),
        (["--calibration", "--homography", "surface"], "--homography goes with shards"),
        (["--calibration", "--batch-size", "2"], "--batch-size goes with shards"),
        (["--calibration", "--workers", "2"], "--workers goes with shards"),
        (["--homography-checkpoint"], "goes with --calibration"),
    ],
)
def test_options_that_have_no_effect_are_usage_errors(images, runs, options, message):
    paths = {"--calibration": images.with_name("plan.json"), "--homography-checkpoint": runs["holistic"]}
    given = [part for option in options for part in (option, *([paths[option]] if option in paths else []))]
    result = run(images, "--checkpoint", runs["holistic"], *given)
    assert result.exit_code == 2
    assert message in result.stderr


@pytest.mark.parametrize(
    ("system", "options", "message"),
    [
        ("ved", [], "is a run of ved, which plans nothing; choose a planner's"),
        ("lstm-ed", ["--homography", "surface"], "lstm-ed warps nothing; leave out --homography surface"),
        ("holistic", ["--homography", "network"], "run `ogmkit predict homography "),
        ("lstm-ed", ["--scenes", "scene-9"], "unknown scene 'scene-9'"),
    ],
)
def test_bad_input_takes_one_line_and_loses_nothing(
    tmp_path, plan_shards, runs, system, options, message, complaints
):
    path = tmp_path / "plans.json"
    path.write_text("what was there")
    for more in ([], ["--out", path]):
        result = run(plan_shards, "--checkpoint", runs[system], *options, *more)
        assert (result.exit_code, result.stdout) == (1, "")
        assert message in result.stderr
        assert complaints(result.stderr).count("\n") == 1
    assert [file.read_text() for file in tmp_path.iterdir()] == ["what was there"]


def test_true_masks_come_from_shards_only(images, runs):
    result = run(images, "--checkpoint", runs["mid-to-end"], "--calibration", images.with_name("plan.json"))
    assert (result.exit_code, result.stdout) == (1, "")
    assert "plans from true masks, which images don't give; plan from shards" in result.stderr


def test_lists_stay_out_of_the_shards(plan_shards, runs):
    result = run(plan_shards, "--checkpoint", runs["lstm-ed"], "--out", plan_shards / "plans.json")
    assert result.exit_code == 1
    assert "which holds nothing but shards; choose another place" in result.stderr
    assert not (plan_shards / "plans.json").exists()


def test_what_breaks_on_the_way_leaves_the_old_file(tmp_path, plan_shards, runs):
    shards, path = shutil.copytree(plan_shards, tmp_path / "shards"), tmp_path / "plans.json"
    path.write_text("what was there")
    with h5py.File(shards / "scene-0002.h5", "r+") as h5:
        h5["CAM_FRONT/image"][4] = h5["CAM_FRONT/image"][4][:-100]
    options = [shards, "--checkpoint", runs["holistic"], "--batch-size", "2"]
    result = run(*options, "--out", path)
    assert result.exit_code == 1
    assert "scene-0002.h5: CAM_FRONT frame 4: image is not a whole JPEG" in result.stderr
    assert path.read_text() == "what was there"
    assert not list(tmp_path.glob(".*"))
    assert len(run(*options).stdout.splitlines()) == 4  # those of the first scene, and no end
