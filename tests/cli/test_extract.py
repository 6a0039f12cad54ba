import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

import h5py
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

MOMENTS = 10
FULL_DISK = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
from ogmkit_cli.main import main
main(sys.argv[1:])
"""


@pytest.fixture(scope="session")
def cache_dir(tmp_path_factory):
    return tmp_path_factory.mktemp("cli-mask-cache")


@pytest.fixture
def arguments(tiny_dataroot, cache_dir):
    """Arguments of a small extract into a folder."""

    def build(out, *more, dataroot=tiny_dataroot):
        grid = ["--cell-size", "0.5", "--rows", "60", "--columns", "40"]
        values = ["extract", dataroot, out, *grid, "--cache-dir", cache_dir, *more]
        return [str(value) for value in values]

    return build


@pytest.fixture
def ogmkit(arguments):
    """Run the command in this process."""

    def run(out, *more, **options):
        return CliRunner().invoke(main, arguments(out, *more, **options))

    return run


def test_it_ends_with_a_summary(tmp_path, ogmkit, complaints):
    result = ogmkit(tmp_path / "out")
    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    lines = dict(line.split(maxsplit=1) for line in result.stdout.splitlines() if line.count("  "))
    assert lines["scenes"] == "2 (0 were there)"
    assert lines["frames"] == "16"
    assert lines["failed"] == "0"
    assert {"valid", "drivable", "vehicle", "time", "size"} <= {
        line.split()[0] for line in result.stdout.splitlines()
    }


def test_a_dry_run_writes_nothing(tmp_path, ogmkit):
    result = ogmkit(tmp_path / "out", "--dry-run")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[-1].split(maxsplit=2)[2] == "2 of 2 scenes to write, 16 frames"
    assert list(tmp_path.iterdir()) == []


def test_a_dry_run_tells_what_is_there(tmp_path, ogmkit, contents):
    ogmkit(tmp_path, "--split", "train")
    before = contents(tmp_path)
    result = ogmkit(tmp_path, "--dry-run")
    assert sorted(line.split()[1] for line in result.stdout.splitlines()[:-1]) == ["keep", "write"]
    result = ogmkit(tmp_path, "--dry-run", "--overwrite")
    assert sorted(line.split()[1] for line in result.stdout.splitlines()[:-1]) == ["replace", "write"]
    assert contents(tmp_path) == before


def test_a_failed_scene_is_named_on_stderr(tmp_path, tiny_dataroot, ogmkit, complaints):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    next((root / "samples/CAM_FRONT").iterdir()).unlink()
    result = ogmkit(tmp_path / "out", dataroot=root)
    assert result.exit_code == 1
    assert result.stdout.splitlines()[-1].split() == ["failed", "1"]
    (line,) = complaints(result.stderr).splitlines()
    assert re.match(r"ogmkit: scene-\d+ failed: .*\.jpg: .*--images none", line)
    assert len(list((tmp_path / "out").glob("*.h5"))) == 1


@pytest.mark.parametrize(
    ("named", "expected"), [(2, r"scene-\d+, scene-\d+ failed: .*"), (1, r"scene-\d+ and 1 more failed: .*")]
)
def test_scenes_that_fail_for_one_reason_take_one_line(
    tmp_path, tiny_dataroot, ogmkit, edit_table, monkeypatch, named, expected, complaints
):
    def share(records):
        records[0]["log_tokens"] = [token for record in records for token in record["log_tokens"]]
        del records[1:]

    monkeypatch.setattr("ogmkit_cli.extract._NAMED", named)
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    edit_table(root, "map", share)
    for path in root.glob("maps/*.png"):
        path.unlink()
    result = ogmkit(tmp_path / "out", dataroot=root)
    assert result.exit_code == 1
    (line,) = complaints(result.stderr).splitlines()
    assert re.fullmatch(rf"ogmkit: {expected}", line)
    assert ".png: " in line


@pytest.mark.parametrize("options", [[], ["--dry-run"]])
def test_a_failed_scene_takes_one_line_whatever_its_name(
    tmp_path, tiny_dataroot, ogmkit, edit_table, options
):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    edit_table(root, "scene", lambda records: records[0].update(name="../a\nb\0c"))
    result = ogmkit(tmp_path / "out", *options, dataroot=root)
    (line,) = (line for line in result.output.splitlines() if "record" in line)
    assert line.removeprefix("ogmkit: ").startswith("../a b\\x00c ")
    assert "cannot be a file name" in line
    assert len(list((tmp_path / "out").glob("*.h5"))) == (0 if options else 1)


def test_strict_raises_what_a_scene_failed_with(tmp_path, tiny_dataroot, ogmkit, complaints):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    for path in (root / "samples/CAM_FRONT").iterdir():
        path.write_bytes(b"no JPEG")
    result = ogmkit(tmp_path / "out", "--strict", dataroot=root)
    assert (result.exit_code, result.stdout) == (1, "")
    assert re.fullmatch(r"ogmkit: error: .*\.jpg: .*is not a whole JPEG.*\n", complaints(result.stderr))


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--scenes", "scene-9999"], "unknown scene"),
        (["--split", "nonsense"], "nonsense"),
        (["--categories", "boat."], "unknown category"),
        (["--rows", "40000", "--columns", "40000"], "grid"),
    ],
)
def test_unknown_names_take_one_line(tmp_path, ogmkit, option, message, complaints):
    result = ogmkit(tmp_path / "out", *option)
    assert (result.exit_code, result.stdout) == (1, "")
    assert message in result.stderr
    assert complaints(result.stderr).count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_old_shards_intact(tmp_path, ogmkit, arguments, contents, complaints):
    out = tmp_path / "out"
    assert ogmkit(out).exit_code == 0
    before = contents(out)
    command = [sys.executable, "-c", FULL_DISK, *arguments(out, "--overwrite")]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "can't be written: File too large" in run.stderr
    assert complaints(run.stderr).count("\n") == 1
    assert {name: digest for name, digest in contents(out).items() if not name.startswith(".")} == before


@pytest.fixture
def slow_arguments(arguments):
    """An extract that takes long enough to be hit."""

    def build(out, workers=2):
        return arguments(
            out, "--workers", workers, "--rows", "1500", "--columns", "1000", "--cell-size", "0.05"
        )

    return build


@pytest.mark.slow
def test_killed_and_finished_it_is_as_undisturbed(tmp_path, slow_arguments, contents, start):
    started = time.monotonic()
    assert start(*slow_arguments(tmp_path / "whole")).finish() == (0, "")
    run_time_s = time.monotonic() - started
    out, hits = tmp_path / "out", 0
    for moment in range(MOMENTS):
        killed = start(*slow_arguments(out))
        time.sleep(run_time_s * (moment + 0.5) / MOMENTS)
        hits += killed.send(signal.SIGKILL)
        killed.finish()
        if moment % 3 == 2:  # leave work for the moments to come
            for shard in out.glob("*.h5"):
                shard.unlink()
    assert hits > MOMENTS / 2
    assert start(*slow_arguments(out)).finish() == (0, "")
    assert contents(out) == contents(tmp_path / "whole")


@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_ends_at_once_with_whole_shards_only(tmp_path, slow_arguments, workers, start):
    out = tmp_path / "out"
    process = start(*slow_arguments(out, workers))
    while not list(out.glob(".scene-*.part")):
        assert process.running()
        time.sleep(0.002)
    process.send(signal.SIGINT)
    assert process.finish() == (130, "ogmkit: interrupted; run the same command to resume\n")
    names = {path.name for path in out.iterdir()}
    assert {name for name in names if not name.endswith(".h5")} == {".ogmkit-extract.json"}


def test_workers_end_with_their_parent(tmp_path, slow_arguments, start):
    out = tmp_path / "out"
    process = start(*slow_arguments(out))
    while not list(out.glob(".scene-*.part")):
        assert process.running()
        time.sleep(0.002)
    os.kill(process.pid, signal.SIGKILL)
    process.finish()  # waits for all that hold its stderr
    assert start(*slow_arguments(out)).finish()[0] == 0


def test_layers_classes_and_instances_by_option(tmp_path, ogmkit, tiny_dataroot):
    options = ["--layers", "lane,ped_crossing", "--layers", "road_divider", "--line-width", "0.8"]
    options += ["--classes", "car,large=bus+truck", "--instances", "--flow", "--future", "2", "--no-map"]
    result = ogmkit(tmp_path / "out", "--scenes", "scene-0001", *options)
    assert result.exit_code == 0, result.stderr
    with h5py.File(tmp_path / "out" / "scene-0001.h5") as shard:
        camera = shard["CAM_FRONT"]
        assert set(camera["layers"]) == {"lane", "ped_crossing", "road_divider"}
        assert set(camera["classes"]) == {"car", "large"}
        assert set(camera["instances"]) == {"id", "token", "offset", "flow"}
        assert camera["future/vehicles"].shape == (8, 2, 60, 40)
        settings = json.loads(shard.attrs["settings"])
    assert (settings["line_width_m"], settings["classes"]) == (0.8, ["car", "large=bus+truck"])
    again = ogmkit(tmp_path / "out", "--scenes", "scene-0001", *options)
    assert "1 (1 were there)" in again.stdout
    other = ogmkit(tmp_path / "out", "--scenes", "scene-0001", *options[:4], "--no-map")
    assert other.exit_code == 1
    assert "flow is" in other.stderr


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--layers", "lanes"], 2, "'lanes' is not one of drivable_area, lane, "),
        (["--classes", "crane"], 1, "unknown category 'crane'"),
        (["--classes", "a/b"], 1, "class 'a/b': is neither NAME, such as car, nor NAME=PART+PART"),
        (["--flow"], 1, "flow: is of instances; ask for them too (--instances)"),
        (["--instances", "--definition", "lss"], 1, "add --definition paper"),
        (["--future", "7"], 2, "7 is not in the range 0<=x<=6"),
    ],
)
def test_what_cant_be_asked_for(tmp_path, ogmkit, options, code, said):
    result = ogmkit(tmp_path / "out", *options)
    assert (result.exit_code, said in result.stderr) == (code, True), result.stderr
    assert not (tmp_path / "out").exists()


def test_a_map_without_its_expansion_is_named_or_left_out(tmp_path, ogmkit, tiny_dataroot, complaints):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    for path in (root / "maps" / "expansion").iterdir():
        path.unlink()
    result = ogmkit(tmp_path / "out", "--layers", "lane", dataroot=root)
    assert result.exit_code == 1
    assert re.search(
        r"expansion/\S+\.json: map expansion is absent.*\(--only-complete\) or --layers", result.stderr
    )
    result = ogmkit(tmp_path / "rest", "--layers", "lane", "--only-complete", dataroot=root)
    assert "left out" in result.stderr
