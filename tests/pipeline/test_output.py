import json
import os
import shutil
from pathlib import Path

import pytest
from filelock import FileLock

from ogmkit.errors import OutputError
from ogmkit.shards.manifest import LOCK


@pytest.mark.parametrize("name", ["notes.txt", "scene-0001.h5", "manifest.json"])
def test_a_foreign_folder_is_refused_and_left_alone(tmp_path, run, name):
    (tmp_path / name).write_text(json.dumps({"name": "a web page"}))
    with pytest.raises(OutputError, match="is not empty, and no ogmkit run made it"):
        run(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_shard_does_not_make_a_foreign_folder_ours(tmp_path, run, undisturbed):
    shutil.copy(next(undisturbed.glob("*.h5")), tmp_path)
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(OutputError, match="no ogmkit run made it"):
        run(tmp_path)


def test_shards_alone_are_an_extraction(tmp_path, run, undisturbed, digests):
    shutil.copy(next(undisturbed.glob("*.h5")), tmp_path)
    assert run(tmp_path).kept == 1
    assert digests(tmp_path) == digests(undisturbed)


@pytest.mark.parametrize("place", [".", "samples/out", "link"])
def test_a_folder_in_the_dataset_is_refused(tmp_path, run, tiny_dataroot, place):
    (tmp_path / "link").symlink_to(tiny_dataroot / "samples")
    out = tmp_path / place if place == "link" else tiny_dataroot / place
    with pytest.raises(OutputError, match="lie in one another"):
        run(out)


def test_a_folder_around_the_dataset_is_refused(run, tiny_dataroot):
    with pytest.raises(OutputError, match="lie in one another"):
        run(tiny_dataroot.parent)


def test_a_file_is_refused(tmp_path, run):
    (tmp_path / "out").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        run(tmp_path / "out")


def test_a_place_that_takes_no_folder_is_named(run):
    with pytest.raises(OutputError, match="/proc/out: can't be written"):
        run(Path("/proc/out"))


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes to read-only folders as well")
def test_a_read_only_folder_is_named(tmp_path, run):
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match="can't be written: Permission denied"):
        run(tmp_path)


def test_two_runs_at_once_are_refused(tmp_path, run):
    out = tmp_path / "out"
    out.mkdir()
    with FileLock(out / LOCK), pytest.raises(OutputError, match="another ogmkit command is writing here"):
        run(out)


def test_what_a_killed_run_left_at_its_very_start_is_no_obstacle(tmp_path, run, undisturbed, digests):
    out = tmp_path / "out"
    out.mkdir()
    (out / LOCK).write_text("")
    (out / "..ogmkit-extract.json.4711.part").write_text("{")
    run(out)
    assert digests(out) == digests(undisturbed)
