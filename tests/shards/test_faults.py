import errno
import fcntl
import os
import shutil
from pathlib import Path

import h5py
import pytest

from ogmkit.errors import ShardError, UnreadableShardError
from ogmkit.shards.faults import damaged, refusal
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.structure import structure_problems
from ogmkit.shards.summary import Expected, is_current
from ogmkit.shards.writer import write_shard

HDF5_TEXT = "can't read (file read failed: time = Sun, errno = 5, error message = 'x', offset = 680)"


@pytest.fixture(scope="module")
def written(tmp_path_factory, scene, small_settings, masks):
    path = tmp_path_factory.mktemp("faults") / "scene-0007.h5"
    write_shard(path, scene, small_settings, masks, dataset_version="v1.0-mini")
    return path


@pytest.fixture
def path(tmp_path, written):
    return Path(shutil.copy(written, tmp_path))


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (OSError(errno.EIO, "h5py's text"), os.strerror(errno.EIO)),
        (PermissionError(errno.EACCES, "h5py's text"), os.strerror(errno.EACCES)),
        (KeyError(HDF5_TEXT), os.strerror(errno.EIO)),
        (OSError(HDF5_TEXT), os.strerror(errno.EIO)),
        (OSError("truncated file: eof = 5"), ""),
        (RuntimeError("filter returned failure"), ""),
        (OSError(errno.EINVAL, "pread before the file's beginning"), ""),
    ],
)
def test_the_system_s_number_decides(error, expected):
    assert refusal(error) == expected
    told = str(damaged(Path("a.h5"), error))
    assert ("remove it" in told) == (expected == "")
    assert told.startswith("a.h5: can't be read (" if expected else "a.h5: is damaged inside (")


def test_a_lock_that_another_program_holds_keeps_nobody_from_reading(path):
    with path.open("r+b") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with Shard(path) as shard:
            assert shard.frames("CAM_FRONT") == 5


def test_a_file_system_that_refuses_is_no_reason_to_remove(tmp_path):
    (tmp_path / "a.h5").symlink_to("a.h5")
    with pytest.raises(UnreadableShardError, match=r"a\.h5: can't be read \(Too many levels") as caught:
        Shard(tmp_path / "a.h5")
    assert "remove" not in str(caught.value)


@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_what_is_no_file_is_named(tmp_path, kind):
    path = tmp_path / "a.h5"
    make = {"pipe": os.mkfifo, "folder": Path.mkdir, "device": lambda p: p.symlink_to("/dev/zero")}
    make[kind](path)
    with pytest.raises(ShardError, match=rf"a\.h5: can't be read \(a (named )?{kind}, not a"):
        Shard(path)


def test_a_sound_shard_that_can_t_be_read_is_not_written_again(tmp_path, small_settings):
    (tmp_path / "a.h5").symlink_to("a.h5")
    settings = ExtractSettings(small_settings, ("CAM_FRONT",))
    with pytest.raises(UnreadableShardError):
        is_current(tmp_path / "a.h5", Expected("a", {}), settings, "v1.0-mini")


def test_a_disk_that_fails_while_the_structure_is_compared_is_told(path, monkeypatch):
    def fail(group, function):
        raise RuntimeError(HDF5_TEXT)

    monkeypatch.setattr(h5py.Group, "visititems", fail)
    with Shard(path) as shard, pytest.raises(UnreadableShardError, match=r"scene-0007\.h5: can't be read"):
        list(structure_problems(shard))
