import h5py
import pytest

from ogmkit.errors import ShardError
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
