import json
import os
import subprocess
from pathlib import Path

import pytest

from ogmkit.base.atomic import replacing, require_outside, write_json
from ogmkit.base.parts import is_part, part_of, remove_parts
from ogmkit.errors import OutputError


def test_the_file_appears_at_the_end_only(tmp_path):
    path = tmp_path / "a.h5"
    path.write_text("old")
    with replacing(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
        assert part == part_of(path) != path
        assert str(os.getpid()) in part.name
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def write_and_fail(path, error):
    with replacing(path) as part:
        part.write_text("half")
        raise error


@pytest.mark.parametrize("error", [ValueError("wrong"), KeyboardInterrupt()])
def test_whatever_is_raised_leaves_the_old_file_alone(tmp_path, error):
    path = tmp_path / "a.h5"
    path.write_text("old")
    with pytest.raises(type(error)):
        write_and_fail(path, error)
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]


def test_what_a_killed_process_left_goes_and_what_another_is_writing_stays(tmp_path):
    ended = subprocess.Popen(["true"])
    ended.wait()
    own = part_of(tmp_path / "b.png").name.removesuffix(f"{os.getpid()}.part")
    of_ended, of_running = f"{own}{ended.pid}.part", f"{own}{os.getppid()}.part"
    elsewhere = f".b.png.other-machine-{ended.pid}.part"  # runs, for all that is known here
    for name in (of_ended, of_running, elsewhere, f".b.png.{ended.pid}.part"):
        (tmp_path / name).write_text("half")
    write_json(tmp_path / "a.json", {})
    assert {path.name for path in tmp_path.iterdir()} == {"a.json", of_running, elsewhere}


def test_a_refused_write_names_the_file_and_the_remedy(tmp_path):
    path = tmp_path / "absent" / "a.json"
    with pytest.raises(OutputError, match=r"a\.json: can't be written: No such file.*run again"):
        write_json(path, {})


def test_what_is_no_regular_file_stays(tmp_path):
    """A rename would put a file in the place of a device; as root, in that of /dev/null."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/null")
    for path in (tmp_path / "pipe", tmp_path / "device", Path()):
        with pytest.raises(OutputError, match="not a regular file"), replacing(path):
            pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["device", "pipe"]


def test_json_is_sorted(tmp_path):
    write_json(tmp_path / "a.json", {"b": 1, "a": [2]})
    text = (tmp_path / "a.json").read_text()
    assert list(json.loads(text)) == ["a", "b"]


def test_only_parts_are_removed(tmp_path):
    names = [".a.h5.123.part", ".a.h5.node-7-123.part", "a.h5", ".hidden", "a.part", ".a.h5.x.part"]
    for name in names:
        (tmp_path / name).write_text("")
    assert [is_part(tmp_path / name) for name in names] == [True, True, False, False, False, False]
    remove_parts(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(names[2:])


@pytest.mark.parametrize("name", ["shards", "shards/picture.png", "other/../shards/a/picture.png"])
def test_shards_keep_their_folder_to_themselves(tmp_path, name):
    with pytest.raises(OutputError, match="holds nothing but shards"):
        require_outside(tmp_path / name, tmp_path / "shards")


def test_beside_the_shards_is_room(tmp_path):
    require_outside(tmp_path / "shards-preview" / "picture.png", tmp_path / "shards")
