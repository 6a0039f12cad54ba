"""The folder of an export: whose it is, what it records, and that nothing in it is half done."""

import hashlib
import json
import re
import shutil

import pytest

from ogmkit.base import locks
from ogmkit.errors import OutputError, ShardError
from ogmkit.pipeline.exports import webdataset
from ogmkit.pipeline.exports.export import export_shards


@pytest.fixture
def out(tmp_path):
    return tmp_path / "export"


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_the_record_has_rows_splits_and_checksums(shards, out):
    summary = export_shards(shards, out, "webdataset")

    record = json.loads((out / "export.json").read_text())
    assert (record["format"], record["layout"], record["complete"]) == ("ogmkit-export", "webdataset", True)
    assert record["manifest_sha256"] == sha256(shards / "manifest.json")
    assert [one["file"] for one in record["files"]] == ["cameras/scene-0001.tar", "cameras/scene-0002.tar"]
    for one, split in zip(record["files"], ("train", "val"), strict=True):
        path = out / one["file"]
        assert (one["rows"], one["splits"], one["bytes"]) == (16, [split], path.stat().st_size)
        assert one["sha256"] == sha256(path)
    assert (summary.rows, summary.kept) == (32, 0)
    assert summary.bytes == sum(one["bytes"] for one in record["files"])
    assert sorted(path.name for path in out.iterdir()) == ["cameras", "export.json"]


def test_what_was_cut_short_goes_on(shards, out, monkeypatch):
    write, calls = webdataset.write_tar, []

    def interrupted(shard, table, splits, path):
        calls.append(shard.scene)
        path.write_bytes(b"half")
        if len(calls) == 2:
            raise KeyboardInterrupt
        write(shard, table, splits, path)

    monkeypatch.setattr(webdataset, "write_tar", interrupted)
    with pytest.raises(KeyboardInterrupt):
        export_shards(shards, out, "webdataset")
    assert json.loads((out / "export.json").read_text())["complete"] is False
    assert [path.name for path in (out / "cameras").iterdir()] == ["scene-0001.tar"]

    monkeypatch.setattr(webdataset, "write_tar", write)
    assert export_shards(shards, out, "webdataset").kept == 1
    assert export_shards(shards, out, "webdataset").kept == 2


def test_what_was_damaged_since_is_written_again(shards, out):
    export_shards(shards, out, "webdataset")
    path = out / "cameras/scene-0002.tar"
    before = path.read_bytes()
    path.write_bytes(before[:-1] + b"x")

    assert export_shards(shards, out, "webdataset").kept == 1
    assert path.read_bytes() == before


def test_another_export_is_refused(copied_shards, out):
    export_shards(copied_shards, out, "webdataset")
    manifest = json.loads((copied_shards / "manifest.json").read_text())
    del manifest["sha256"]  # a manifest without its checksum is another file
    (copied_shards / "manifest.json").write_text(json.dumps(manifest))

    with pytest.raises(OutputError, match=r"export\.json: manifest_sha256 is \w+ here but \w+ there; remove"):
        export_shards(copied_shards, out, "webdataset")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("notes.txt", "mine", "is not empty, and no export made it; choose another OUT"),
        ("export.json", "{", "export.json: is damaged"),
        ("export.json", '{"files": [{"file": 1}], "splits": []}', "export.json: is damaged"),
        ("export.json", '{"files": []}', "export.json: layout is webdataset here but absent there"),
    ],
)
def test_a_folder_of_something_else_is_refused(shards, out, name, content, message):
    out.mkdir()
    (out / name).write_text(content)
    with pytest.raises(OutputError, match=re.escape(message)):
        export_shards(shards, out, "webdataset")
    assert (out / name).read_text() == content


def test_shards_hold_nothing_but_shards(copied_shards):
    with pytest.raises(OutputError, match="holds nothing but shards"):
        export_shards(copied_shards, copied_shards / "out", "webdataset")


def test_one_run_at_a_time(shards, out):
    with (
        locks.locked(out, ".ogmkit-export.lock"),
        pytest.raises(OutputError, match="another ogmkit command is writing here"),
    ):
        export_shards(shards, out, "webdataset")


def test_a_damaged_shard_gets_no_valid_checksum(copied_shards, out):
    path = copied_shards / "scene-0002.h5"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ShardError, match=r"scene-0002\.h5: has another checksum than the manifest says"):
        export_shards(copied_shards, out, "webdataset")


def test_shards_that_are_being_added_to_are_refused(copied_shards, out):
    (copied_shards / ".ogmkit-amend.json").write_text('{"command": "homography-fit"}')
    with pytest.raises(OutputError, match="homography-fit is unfinished"):
        export_shards(copied_shards, out, "webdataset")
    assert not out.exists()


def test_a_folder_without_shards_is_refused(tmp_path, out):
    shutil.rmtree(out, ignore_errors=True)
    with pytest.raises(ShardError, match=r"manifest\.json: can't be read"):
        export_shards(tmp_path, out, "webdataset")
    assert not out.exists()
