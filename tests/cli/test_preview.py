"""`ogmkit preview` end to end on real shards of a synthetic dataset."""

import shutil

import cv2
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main


@pytest.fixture(scope="module")
def shards(tiny_dataroot, tmp_path_factory):
    out = tmp_path_factory.mktemp("preview") / "shards"
    arguments = ["extract", tiny_dataroot, out, "--camera", "CAM_FRONT", "--camera", "CAM_BACK"]
    coarse = ["--cell-size", "0.5", "--rows", "200", "--columns", "110"]
    cache = ["--cache-dir", tmp_path_factory.mktemp("cache")]
    result = CliRunner().invoke(main, [str(argument) for argument in (*arguments, *coarse, *cache)])
    assert result.exit_code == 0, result.output
    return out


def run(*arguments):
    return CliRunner().invoke(main, ["preview", *map(str, arguments)])


def test_sheets_are_written_and_named_on_stdout(shards, tmp_path):
    result = run(shards, "--out", tmp_path, "--camera", "CAM_BACK", "--frames", 2)

    assert result.exit_code == 0
    paths = result.stdout.splitlines()
    assert sorted(paths) == sorted(str(path) for path in tmp_path.iterdir())
    assert len(paths) == 2
    assert all(path.endswith("_CAM_BACK.png") for path in paths)
    assert all(cv2.imread(path).shape[1] > 1000 for path in paths)


def test_every_view_of_what_the_commands_made(shards, tmp_path):
    out = tmp_path / "shards"
    shutil.copytree(shards, out)
    for arguments in (
        ["homography-fit", out, "--method", "surface"],
        ["render-footprints", out],
        ["render-footprints", out, "--method", "full-body"],
    ):
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        assert result.exit_code == 0, result.output
    views = ("targets", "footprints", "stretch", "masks")
    options = [part for view in views for part in ("--view", view)]
    result = run(out, "--out", tmp_path / "pictures", "--camera", "CAM_FRONT", "--frames", 1, *options)

    assert result.exit_code == 0, result.output
    endings = [path.partition("_CAM_FRONT")[2] for path in result.stdout.splitlines()]
    assert endings == 2 * [".png", "_footprints_surface.png", "_stretch_surface.png", "_masks_surface.png"]


def test_a_view_without_its_masks_names_the_command(shards, tmp_path):
    result = run(shards, "--out", tmp_path, "--view", "footprints", "--masks", "dlt")

    assert result.exit_code == 1
    assert result.stderr.endswith(f"run `ogmkit render-footprints {shards} --method warp --homography dlt`\n")
    assert result.stderr.count("\n") == 1
    assert not any(tmp_path.iterdir())


def test_failures_are_one_line_and_exit_1(shards, tmp_path):
    result = run(shards, "--out", tmp_path, "--scenes", "no-such-scene")

    assert result.exit_code == 1
    assert result.stderr.startswith(f"ogmkit: error: {shards}: unknown scene 'no-such-scene'")
    assert result.stderr.count("\n") == 1


def test_scenes_by_a_pattern(shards, tmp_path):
    result = run(shards, "--out", tmp_path, "--scenes", "*-0002")
    assert {path.partition("_CAM")[0] for path in result.stdout.splitlines()} == {f"{tmp_path}/scene-0002"}
    failed = run(shards, "--out", tmp_path, "--scenes", "scene-09*")
    assert (failed.exit_code, failed.stderr) == (
        1,
        f"ogmkit: error: {shards}: no scene matches 'scene-09*'; did you mean scene-0002 or scene-0001?\n",
    )


def test_usage_errors_exit_2(tmp_path):
    assert run(tmp_path / "absent").exit_code == 2
    assert run(tmp_path, "--frames", "0").exit_code == 2
    assert run(tmp_path, "--view", "rewarp").exit_code == 2
