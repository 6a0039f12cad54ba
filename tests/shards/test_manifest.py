import json

import pytest

from ogmkit.errors import ShardError
from ogmkit.shards.manifest import Manifest, ShardEntry, read_manifest, write_manifest
from ogmkit.shards.settings import ExtractSettings


@pytest.fixture
def manifest():
    shards = (
        ShardEntry("scene-0001", "scene-0001.h5", "boston-seaport", 40, 1234, "ab" * 32, ("mini", "train")),
        ShardEntry("scene-0002", "scene-0002.h5", "boston-seaport", 41, 1235, "cd" * 32, ("val",)),
    )
    return Manifest("v1.0-mini", "/data/nuscenes", ExtractSettings(), shards)


@pytest.fixture
def edit(tmp_path, manifest):
    """Write the manifest with one change."""

    def write(change):
        write_manifest(tmp_path, manifest)
        content = json.loads((tmp_path / "manifest.json").read_text())
        del content["sha256"]  # as of a manifest from before there was one
        change(content)
        (tmp_path / "manifest.json").write_text(json.dumps(content))
        return tmp_path

    return write


def test_it_survives_its_file(tmp_path, manifest):
    write_manifest(tmp_path, manifest)
    assert read_manifest(tmp_path) == manifest


def test_a_manifest_of_before_without_a_checksum_is_read(edit, manifest):
    assert read_manifest(edit(lambda content: None)) == manifest


@pytest.mark.sampled(1)
@pytest.mark.parametrize("of_byte", range(8))
def test_every_flipped_bit_is_found(tmp_path, manifest, of_byte):
    write_manifest(tmp_path, manifest)
    path = tmp_path / "manifest.json"
    sound = path.read_bytes()
    for place in range(len(sound)):
        damaged = bytearray(sound)
        damaged[place] ^= 1 << (place + of_byte) % 8
        path.write_bytes(damaged)
        with pytest.raises(ShardError, match=r"manifest\.json: "):
            read_manifest(tmp_path)


def test_a_split_is_its_shards(manifest):
    assert [shard.scene for shard in manifest.split("train")] == ["scene-0001"]
    with pytest.raises(ShardError, match="no shard is in split 'test'; there is mini, train, val"):
        manifest.split("test")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: content.update(format="webmanifest"), "not an ogmkit-manifest of version 1"),
        (lambda content: content.update(format_version=2), "not an ogmkit-manifest of version 1"),
        (lambda content: content.pop("settings"), "is damaged"),
        (lambda content: content["settings"].update(compression="zip"), "is damaged"),
        (lambda content: content["shards"][0].pop("sha256"), "is damaged"),
        (lambda content: content["shards"][0].update(bytes="many"), "no integers"),
        (lambda content: content["shards"][0].update(file="../scene-0001.h5"), "leaves the folder"),
        (lambda content: content.update(shards=[3]), "is damaged"),
    ],
)
def test_a_damaged_manifest_is_named(edit, change, message):
    with pytest.raises(ShardError, match=rf"manifest\.json: .*{message}"):
        read_manifest(edit(change))


@pytest.mark.parametrize("text", ["", "{", "[1]", "<html>", "\ufeff{}", "[" * 100_000])
def test_a_file_that_is_no_json_object_is_named(tmp_path, text):
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(ShardError, match=r"manifest\.json: is damaged"):
        read_manifest(tmp_path)


def test_an_absent_manifest_is_named(tmp_path):
    with pytest.raises(ShardError, match=r"manifest\.json: can't be read .*finished"):
        read_manifest(tmp_path)
