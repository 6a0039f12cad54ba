"""`ogmkit view` end to end."""

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

RERUN = "rerun-sdk is not installed: pip install 'ogmkit[view]'"


def run(*arguments):
    return CliRunner().invoke(main, ["view", *map(str, arguments)])


def test_a_recording_is_written_and_named_on_stdout(sample_shards, tmp_path):
    rerun = pytest.importorskip("rerun", reason=RERUN)
    path = tmp_path / "scene.rrd"
    options = ["--scenes", "scene-0002", "--camera", "CAM_BACK", "--theme", "light"]

    result = run(sample_shards, "--save", path, *options)

    assert (result.exit_code, result.stdout) == (0, f"{path}\n")
    places = {chunk.entity_path for chunk in rerun.chunk.RrdReader(path).store().stream().collect().stream()}
    assert "/scene-0002/CAM_BACK/camera/image" in places
    assert not any("scene-0001" in place or "CAM_FRONT" in place for place in places)

    again = run(sample_shards, "--save", path, *options)
    assert again.exit_code == 1
    assert f"{path}: is there already; choose another name, or --overwrite" in again.stderr
    assert run(sample_shards, "--save", path, "--overwrite", *options).exit_code == 0


def test_names_that_are_not_there_are_told(sample_shards, tmp_path):
    pytest.importorskip("rerun", reason=RERUN)
    for option, name in (("--scenes", "scene-0009"), ("--camera", "CAM_TOP")):
        result = run(sample_shards, "--save", tmp_path / "x.rrd", option, name)
        assert result.exit_code == 1
        assert f"{name!r}" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_recording_that_is_a_folder_is_a_usage_error(sample_shards, tmp_path):
    assert run(sample_shards, "--save", tmp_path).exit_code == 2
