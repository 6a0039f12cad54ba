import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from ogmkit.errors import ShardError, UnreadableShardError
from ogmkit.shards.reader import Shard
from ogmkit.shards.writer import write_shard


@pytest.fixture
def path(tmp_path, scene, small_settings, masks):
    path = tmp_path / "scene-0007.h5"
    write_shard(path, scene, small_settings, masks, dataset_version="v1.0-mini")
    return path


def test_frames_and_grid(path, small_grid):
    with Shard(path) as shard:
        assert shard.frames("CAM_FRONT") == 5
        assert shard.grid == small_grid
        assert shard.settings.cameras == ("CAM_BACK", "CAM_FRONT")
    assert not shard.h5


@pytest.mark.parametrize("name", ["CAM_FRONT/nothing", "CAM_TOP/image", "CAM_FRONT/boxes"])
def test_an_unknown_dataset_is_named(path, name):
    camera, _, dataset = name.partition("/")
    with Shard(path) as shard, pytest.raises(ShardError, match=f"has no dataset {name}"):
        shard.dataset(camera, dataset)


def test_an_absent_shard_is_named(tmp_path):
    with pytest.raises(ShardError, match=r"scene-0001\.h5: is absent"):
        Shard(tmp_path / "scene-0001.h5")


@pytest.mark.parametrize("content", [b"", b"<html>", b"\x89HDF\r\n\x1a\n"])
def test_what_is_no_hdf5_is_named(tmp_path, content):
    (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(ShardError, match=r"a\.h5: not an HDF5 file, or cut short"):
        Shard(tmp_path / "a.h5")


def test_foreign_hdf5_and_other_versions_are_named(path):
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = 2
    with pytest.raises(ShardError, match="has shard format 2, not 1; remove it"):
        Shard(path)
    with h5py.File(path, "r+") as file:
        del file.attrs["format"]
    with pytest.raises(ShardError, match="no ogmkit shard"):
        Shard(path)


def replace_dataset(path, name, make):
    """Put another dataset in the place of one of CAM_FRONT's."""
    with h5py.File(path, "r+") as file:
        del file["CAM_FRONT"][name]
        make(file["CAM_FRONT"], name)


def external_link(group, name):
    group[name] = h5py.ExternalLink("other.h5", f"/CAM_FRONT/{name}")


def soft_link(group, name):
    group[name] = h5py.SoftLink(f"/CAM_BACK/{name}")


@pytest.mark.parametrize("link", [external_link, soft_link])
def test_links_are_refused_before_anything_is_read(tmp_path, path, link):
    shutil.copy(path, tmp_path / "other.h5")
    replace_dataset(path, "intrinsics", link)
    with pytest.raises(
        ShardError, match="/CAM_FRONT/intrinsics is a link to another place, not data; remove"
    ):
        Shard(path)


def raw_storage(group, name):
    group.create_dataset(name, (5, 3, 3), "f8", external=[("elsewhere", 0, 5 * 9 * 8)])


def virtual(group, name):
    layout = h5py.VirtualLayout((5, 3, 3), "f8")
    layout[:] = h5py.VirtualSource("other.h5", f"CAM_FRONT/{name}", shape=(5, 3, 3))
    group.create_virtual_dataset(name, layout)


@pytest.mark.parametrize("make", [raw_storage, virtual])
def test_data_in_another_file_is_refused(tmp_path, path, make):
    shutil.copy(path, tmp_path / "other.h5")
    replace_dataset(path, "intrinsics", make)
    with Shard(path) as shard, pytest.raises(ShardError, match="intrinsics keeps its data in another file"):
        shard.dataset("CAM_FRONT", "intrinsics")


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("timestamp_us", np.zeros(5, np.int32), "timestamp_us has dtype int32, not int64"),
        ("timestamp_us", np.zeros(4, np.int64), r"timestamp_us has shape \(4,\), not \(5,\)"),
        ("drivable", np.zeros((5, 60, 41), np.uint8), r"has shape \(5, 60, 41\), not \(5, 60, 40\)"),
        ("trajectory/past", np.zeros((5, 7, 2)), r"past has shape \(5, 7, 2\), not \(5, 6, 2\)"),
        ("boxes/size_wlh", np.zeros((9, 3)), r"size_wlh has shape \(9, 3\), not \(10, 3\)"),
    ],
)
def test_shape_and_dtype_are_the_schema_s(path, name, data, problem):
    replace_dataset(path, name, lambda group, name: group.create_dataset(name, data=data))
    with Shard(path) as shard, pytest.raises(ShardError, match=f"{problem}; remove it"):
        shard.dataset("CAM_FRONT", name)


def test_damage_is_told_where_it_is_read(path):
    with h5py.File(path) as file:
        chunk = file["CAM_FRONT/drivable"].id.get_chunk_info(2)
    data = bytearray(path.read_bytes())
    data[chunk.byte_offset : chunk.byte_offset + chunk.size] = b"\xff" * chunk.size
    path.write_bytes(data)
    with Shard(path) as shard:
        drivable = shard.dataset("CAM_FRONT", "drivable")
        assert drivable[1].shape == (60, 40)
        with pytest.raises(ShardError, match=r"scene-0007\.h5: is damaged inside"):
            drivable[2]


def test_a_disk_that_fails_while_reading_is_no_reason_to_remove(path):
    """The file's descriptor is taken away from under HDF5."""
    with Shard(path) as shard:
        drivable = shard.dataset("CAM_FRONT", "drivable")
        descriptors = Path("/proc/self/fd")
        if not descriptors.exists():
            pytest.skip("no /proc here")
        own = [int(one.name) for one in descriptors.iterdir() if os.path.realpath(one) == str(path.resolve())]
        write_only = os.open(path, os.O_WRONLY)
        for one in own:
            os.dup2(write_only, one)
        os.close(write_only)
        with pytest.raises(UnreadableShardError, match=r"can't be read \(Bad file descriptor\)") as caught:
            drivable[2]
    assert "remove" not in str(caught.value)


def test_a_file_that_this_process_has_open_with_locks_is_read_too(path):
    with h5py.File(path), Shard(path) as shard:
        assert shard.frames("CAM_FRONT") == 5
