import hashlib
import shutil

import h5py
import numpy as np
import pytest

from ogmkit.errors import SettingsError, ShardError
from ogmkit.shards.additions import add_to_shard, added_values, new_group, place, require_name
from ogmkit.shards.layout import store_dataset
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema import HOMOGRAPHY
from ogmkit.shards.writer import write_shard

VALUES = {"method": "dlt", "settings": {"min_points": 4, "categories": ("a", "b")}, "checkpoint_sha256": ""}


@pytest.fixture(scope="module")
def sound(tmp_path_factory, scene, small_settings, masks):
    path = tmp_path_factory.mktemp("sound") / "scene-0007.h5"
    write_shard(path, scene, small_settings, masks, dataset_version="v1.0-mini")
    return path


@pytest.fixture
def path(tmp_path, sound):
    return shutil.copy(sound, tmp_path / sound.name)


def adding(name="dlt", rows=5):
    """A `write` that adds one group of one dataset."""

    def write(file):
        with file.writing() as h5:
            group = new_group(h5, "CAM_FRONT", HOMOGRAPHY, name, VALUES)
            store_dataset(group, HOMOGRAPHY.field("valid"), np.ones(rows, bool), {"N": rows})

    return write


def everything(path):
    """Name → content and attributes of all there is in a file."""
    found = {}

    def add(name, item):
        content = item[()].tolist() if isinstance(item, h5py.Dataset) else None
        if isinstance(item, h5py.Dataset) and h5py.check_vlen_dtype(item.dtype):
            content = [
                bytes(np.asarray(row).data) if isinstance(row, np.ndarray) else row for row in item[()]
            ]
        layout = (item.dtype, item.chunks, item.compression) if isinstance(item, h5py.Dataset) else None
        found[name] = (repr(content), layout, dict(item.attrs))

    with h5py.File(path) as h5:
        h5.visititems(add)
        return found | {"": dict(h5.attrs)}


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_all_that_was_there_stays_and_the_new_group_is_there(path, sound):
    add_to_shard(path, adding())
    there, before = everything(path), everything(sound)
    assert {name: there[name] for name in before} == before
    assert there.keys() - before.keys() == {
        "CAM_FRONT/homography",
        "CAM_FRONT/homography/dlt",
        "CAM_FRONT/homography/dlt/valid",
    }
    assert list(path.parent.iterdir()) == [path]


def test_replacing_leaves_no_hole(path):
    add_to_shard(path, adding())
    once = digest(path)
    for rows in (5000, 5):
        add_to_shard(path, adding(rows=rows), replaced={place("CAM_FRONT", HOMOGRAPHY, "dlt")})
    assert digest(path) == once


def test_what_is_not_replaced_is_kept_beside_it(path):
    add_to_shard(path, adding("dlt"))
    add_to_shard(path, adding("surface", rows=7))
    add_to_shard(path, adding("dlt", rows=3), replaced={place("CAM_FRONT", HOMOGRAPHY, "dlt")})
    with Shard(path) as shard:
        assert shard.added("CAM_FRONT", "homography") == ("dlt", "surface")
        assert shard.added("CAM_BACK", "homography") == ()
        assert len(shard.h5["CAM_FRONT/homography/dlt/valid"]) == 3
        assert len(shard.h5["CAM_FRONT/homography/surface/valid"]) == 7


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_a_failure_half_way_leaves_the_old_shard(path, sound, error):
    def fail(file):
        adding()(file)
        raise error

    with pytest.raises(error):
        add_to_shard(path, fail)
    assert digest(path) == digest(sound)
    assert list(path.parent.iterdir()) == [path]


def test_damage_that_is_read_is_not_taken_for_a_full_disk(path):
    with h5py.File(path) as h5:
        chunk = h5["CAM_FRONT/drivable"].id.get_chunk_info(2)
    data = bytearray(path.read_bytes())
    data[chunk.byte_offset : chunk.byte_offset + chunk.size] = b"\xff" * chunk.size
    path.write_bytes(data)

    def write(file):
        with Shard(path) as shard:
            shard.dataset("CAM_FRONT", "drivable")[2]

    with pytest.raises(ShardError, match=r"scene-0007\.h5: is damaged inside .*remove it"):
        add_to_shard(path, write)
    assert path.read_bytes() == data


def test_the_attributes_come_back_as_they_were_given(path):
    add_to_shard(path, adding())
    with Shard(path) as shard:
        assert added_values(shard, "CAM_FRONT", HOMOGRAPHY, "surface") is None
        found = added_values(shard, "CAM_FRONT", HOMOGRAPHY, "dlt")
    assert found == VALUES | {"settings": {"min_points": 4, "categories": ["a", "b"]}}


def test_damaged_settings_are_named(path):
    add_to_shard(path, adding())
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/homography/dlt"].attrs["settings"] = "{"
    with Shard(path) as shard, pytest.raises(ShardError, match="/CAM_FRONT/homography/dlt has damaged sett"):
        added_values(shard, "CAM_FRONT", HOMOGRAPHY, "dlt")


@pytest.mark.parametrize("name", ["network-b2.1", "surface", "7", "a" * 100])
def test_good_names(name):
    require_name(name)


@pytest.mark.parametrize("name", ["", ".", "..", "a/b", "-x", "a b", "ü", "a\n", "a" * 101])
def test_bad_names(name):
    with pytest.raises(SettingsError, match="use letters, digits"):
        require_name(name)


@pytest.mark.parametrize("attribute", ["method", "settings", "checkpoint_sha256"])
@pytest.mark.parametrize("damage", ["absent", "no text"])
def test_a_damaged_attribute_is_named(path, attribute, damage):
    add_to_shard(path, adding())
    with h5py.File(path, "r+") as h5:
        attributes = h5[place("CAM_FRONT", HOMOGRAPHY, "dlt")].attrs
        del attributes[attribute]
        if damage == "no text":
            attributes[attribute] = np.arange(3)
    with (
        Shard(path) as shard,
        pytest.raises(ShardError, match=f"{path.name}: /CAM_FRONT/homography/dlt.*{attribute}"),
    ):
        added_values(shard, "CAM_FRONT", HOMOGRAPHY, "dlt")
