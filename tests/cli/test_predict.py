import json
import re
import shutil
import signal
import time

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main
from ogmkit_cli.predict import command
from ogmkit_cli.predict_masks import SYSTEMS

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

from ogmkit.grid import GridSpec
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

GRID = GridSpec(0.5, 60, 40, 60.0, 40 * 6 / 11)
MOMENTS = 4


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, tiny_dataroot):
    """Shards with homographies; tests only read them."""
    out = tmp_path_factory.mktemp("fitted") / "out"
    grid = ["--cell-size", "0.5", "--rows", "60", "--columns", "40", "--lidar"]
    cache = ["--cache-dir", str(tmp_path_factory.mktemp("cache"))]
    for arguments in (
        ["extract", str(tiny_dataroot), str(out), *grid, *cache],
        ["homography-fit", str(out), "--method", "surface"],
    ):
        result = CliRunner().invoke(main, arguments)
        assert result.exit_code == 0, result.output
    return out


@pytest.fixture(scope="module")
def runs(tmp_path_factory, make_run):
    """System → RUN."""

    def change(net):
        for place, value in enumerate((0.1, -0.6, 20.0, 0.0, 0.3, -58.0, 0.0, -0.02, 1.0)):
            net.code.mean.view(-1)[place] = -value
        net.code.scale[:] = 1e-3

    folder = tmp_path_factory.mktemp("runs")
    cameras = ("CAM_FRONT",)
    made = {system: make_run(folder / system, system, GRID, cameras, bev_cell_m=1.0) for system in SYSTEMS}
    return made | {"homography": make_run(folder / "homography", "homography", GRID, cameras, change)}


@pytest.fixture
def out(tmp_path, fitted):
    return shutil.copytree(fitted, tmp_path / "out")


def run(*arguments):
    return CliRunner().invoke(main, ["predict", *map(str, arguments)])


def test_homographies_are_added_and_shown(out, runs, complaints):
    result = run("homography", out, "--checkpoint", runs["homography"], "--name", "network-mine")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0].startswith("16 frames in 2 shards (0 already complete), ")
    assert re.match(r"network-mine +16 of 16 ", lines[3])
    assert "Left-out boxes by distance" in result.stdout
    assert verify_folder(out) == ()
    rendered = CliRunner().invoke(main, ["render-footprints", str(out), "--homography", "network-mine"])
    assert rendered.stdout.startswith("network-mine: 16 frames in 2 shards")


@pytest.mark.parametrize("system", SYSTEMS)
def test_masks_are_written(tmp_path, fitted, runs, system, complaints):
    folder = tmp_path / "folder"
    options = ["--checkpoint", runs[system], "--out", folder, "--limit-frames", 3]
    result = run(system, fitted, *options, "--split", "val")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    warped = " warped by surface" if system == "footprints" else ""
    assert result.stdout.startswith(f"{folder}: {system}{warped}, 3 frames in 1 file, ")
    assert [path.name for path in folder.iterdir()] == ["scene-0002.h5"]


def test_pictures_are_written_from_images_and_a_calibration(tmp_path, fitted, runs, complaints):
    images = tmp_path / "images"
    images.mkdir()
    with Shard(fitted / "scene-0001.h5") as shard:
        (images / "a.jpg").write_bytes(shard.image("CAM_FRONT", 0).tobytes())
    (tmp_path / "calibration.json").write_text(json.dumps({"image_size": [90, 160]}))
    options = ["--checkpoint", runs["footprints"], "--homography-checkpoint", runs["homography"]]
    options += ["--calibration", tmp_path / "calibration.json"]
    result = run("footprints", images, *options, "--out", tmp_path / "folder", "--format", "png")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    assert ", 1 frame in 4 files, " in result.stdout
    assert {path.name for path in (tmp_path / "folder").iterdir()} == {
        f"a_{view}_{target}.png" for view in ("bev", "image") for target in ("drivable", "vehicles")
    }


def test_options_that_have_no_effect_are_usage_errors(tmp_path, fitted, runs):
    start = ["footprints", fitted, "--checkpoint", runs["footprints"], "--out", tmp_path / "folder"]
    (tmp_path / "calibration.json").write_text("{}")
    calibrated = [*start, "--calibration", tmp_path / "calibration.json"]
    for more in (["--split", "val"], ["--homography", "surface"], ["--limit-frames", "2"]):
        result = run(*calibrated, *more)
        assert result.exit_code == 2
        assert f"{more[0]} goes with shards" in result.stderr
    result = run(*start, "--homography-checkpoint", runs["homography"])
    assert result.exit_code == 2
    assert "goes with --calibration" in result.stderr
    assert "homography" not in {option.name for option in command.commands["ved"].params}


def test_a_scheduler_goes_with_shards(tmp_path, fitted, runs):
    pytest.importorskip("distributed", reason="distributed is not installed: pip install 'ogmkit[cluster]'")
    (tmp_path / "calibration.json").write_text("{}")
    options = ["--out", tmp_path / "folder", "--calibration", tmp_path / "calibration.json"]
    result = run("ved", fitted, "--checkpoint", runs["ved"], *options, "--scheduler", "local")
    assert result.exit_code == 2
    assert "--scheduler goes with shards, not with --calibration" in result.stderr


@pytest.mark.parametrize(
    ("system", "checkpoint", "more", "message"),
    [
        ("homography", "ved", [], "is a run of ved, not of homography; choose another"),
        ("homography", "homography", ["--name", "mine"], "are called network or network-"),
        ("homography", "homography", ["--camera", "CAM_TOP"], "unknown camera 'CAM_TOP'"),
        ("oft", "ved", [], "is a run of ved, not of oft; choose another"),
        ("ved", "ved", ["--scenes", "scene-9"], "unknown scene 'scene-9'"),
    ],
)
def test_bad_input_takes_one_line_and_loses_nothing(
    tmp_path, out, runs, system, checkpoint, more, message, contents, complaints
):
    before = contents(out)
    place = [] if system == "homography" else ["--out", tmp_path / "folder"]
    result = run(system, out, "--checkpoint", runs[checkpoint], *place, *more)
    assert (result.exit_code, result.stdout) == (1, "")
    assert message in result.stderr
    assert complaints(result.stderr).count("\n") == 1
    assert contents(out) == before
    assert not (tmp_path / "folder").exists()


@pytest.mark.slow
def test_killed_and_finished_it_is_as_undisturbed(tmp_path, out, fitted, runs, contents, start):
    options = ["--checkpoint", runs["homography"], "--batch-size", "1"]
    whole = shutil.copytree(fitted, tmp_path / "whole")
    started = time.monotonic()
    assert start("predict", "homography", whole, *options).finish() == (0, "")
    run_time_s = time.monotonic() - started
    hits = 0
    for moment in range(MOMENTS):
        process = start("predict", "homography", out, *options)
        time.sleep(run_time_s * (0.7 + 0.3 * moment / MOMENTS))  # most of the time torch is imported
        hits += process.send(signal.SIGKILL)
        process.finish()
        for path in out.glob("*.h5"):
            with Shard(path) as shard:  # whole: the old one or the new one
                assert shard.added("CAM_FRONT", "homography") in (("surface",), ("network", "surface"))
    assert hits
    assert start("predict", "homography", out, *options).finish() == (0, "")
    assert contents(out) == contents(whole)
    assert verify_folder(out) == ()
