import shutil
from dataclasses import replace

import pytest

from ogmkit.errors import ShardError
from ogmkit.shards.folder import ShardFolder
from ogmkit.shards.listed import listed_shard, require_unchanged
from ogmkit.shards.manifest import AMENDING, Manifest, ShardEntry, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.summary import summarise
from ogmkit.shards.writer import write_shard


@pytest.fixture(scope="module")
def sound(tmp_path_factory, scene, small_settings, masks):
    out = tmp_path_factory.mktemp("listed")
    write_shard(out / "scene-0007.h5", scene, small_settings, masks, dataset_version="v1.0-mini")
    found = summarise(out / "scene-0007.h5")
    entry = ShardEntry("scene-0007", "scene-0007.h5", "boston", found.frames, found.bytes, found.sha256, ())
    settings = ExtractSettings(small_settings, ("CAM_FRONT", "CAM_BACK"))
    write_manifest(out, Manifest("v1.0-mini", "/data", settings, (entry,)))
    return out


@pytest.fixture
def folder(tmp_path, sound):
    return ShardFolder(shutil.copytree(sound, tmp_path / "out"))


def entry_of(folder):
    (entry,) = folder.manifest.shards
    return entry


def test_a_shard_as_the_manifest_says_is_opened(folder):
    require_unchanged(folder.file("scene-0007"), entry_of(folder))
    with folder.shard("scene-0007") as shard:
        assert shard.scene == "scene-0007"


def test_another_size_is_refused_before_the_shard_is_opened(folder):
    folder.file("scene-0007").write_bytes(b"12345")
    with pytest.raises(
        ShardError, match=r"scene-0007\.h5: has 5 bytes, by the manifest \d+; remove it and run"
    ):
        folder.shard("scene-0007")


def test_while_a_command_adds_to_shards_their_sizes_are_not_known(folder):
    (folder.path / AMENDING).write_text('{"command": "homography-fit"}')
    with listed_shard(folder.path, replace(entry_of(folder), bytes=7)) as shard:
        assert shard.scene == "scene-0007"


def test_an_absent_shard_is_named(folder):
    folder.file("scene-0007").unlink()
    for call in (folder.shard, lambda scene: require_unchanged(folder.file(scene), entry_of(folder))):
        with pytest.raises(ShardError, match=r"scene-0007\.h5: is absent; run `ogmkit extract` again"):
            call("scene-0007")


@pytest.mark.parametrize("place", [100, -3])
def test_a_changed_byte_is_noticed(folder, place):
    path = folder.file("scene-0007")
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(data)
    with pytest.raises(ShardError, match=r"scene-0007\.h5: has another checksum than the manifest says"):
        require_unchanged(path, entry_of(folder))
