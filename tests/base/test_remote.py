"""Folders of shards in an object store: a real S3 server on loopback, and a line to it that can be cut."""

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.base import remote
from ogmkit.base.atomic import remove, write_json
from ogmkit.base.mirror import Mirror, mirror_of
from ogmkit.base.remote import open_mirror
from ogmkit.errors import MissingPackageError, SettingsError
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import read_manifest

if any(importlib.util.find_spec(name) is None for name in ("s3fs", "moto", "flask_cors")):
    pytest.skip(
        "s3fs or moto's server is not installed: pip install 'ogmkit[dev,remote]'", allow_module_level=True
    )

GRID = ("--cell-size", "0.5", "--rows", "80", "--columns", "60", "--ego-row", "80", "--ego-column", "34")
SERVER = Path(__file__).parent / "store" / "server.py"


class Line:
    """What leads to the server, which is another process."""

    def __init__(self, server):
        self._server = server
        self.port = int(server.stdout.readline())

    @contextmanager
    def cut(self, left):
        """Inside, only so many bytes more reach the server."""
        self._say(left)
        try:
            yield
        finally:
            self._say("all")

    def _say(self, left):
        self._server.stdin.write(f"{left}\n")
        self._server.stdin.flush()
        self._server.stdout.readline()


@pytest.fixture(scope="module")
def line():
    """To moto's server; in this process's environment, all s3:// URLs lead there."""
    command = [sys.executable, str(SERVER)]
    with (
        subprocess.Popen(command, stdin=-1, stdout=-1, stderr=subprocess.DEVNULL, text=True) as server,
        pytest.MonkeyPatch.context() as patch,
    ):
        found = Line(server)
        for name, value in {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{found.port}",
            "AWS_ACCESS_KEY_ID": "nobody",
            "AWS_SECRET_ACCESS_KEY": "nothing",
            "AWS_DEFAULT_REGION": "us-east-1",
            "AWS_MAX_ATTEMPTS": "1",
        }.items():
            patch.setenv(name, value)
        yield found
        server.kill()


@pytest.fixture
def store(line, tmp_path, monkeypatch):
    """An empty bucket, as its file system; this machine has no copies of anything."""
    import s3fs

    monkeypatch.setenv(remote.VARIABLE, str(tmp_path / "remote"))
    found = s3fs.S3FileSystem(use_listings_cache=False)
    if found.exists("world"):
        found.rm("world", recursive=True)
    found.mkdir("world")
    return found


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """Turn this machine into another, which has no copies."""
    return lambda name="other": monkeypatch.setenv(remote.VARIABLE, str(tmp_path / name))


@pytest.fixture
def ogmkit(tmp_path):
    """Run a command: `ogmkit(…)` gives exit code and output."""

    def run(*arguments):
        done = CliRunner().invoke(main, [str(argument) for argument in arguments])
        return done.exit_code, done.output

    return run


@pytest.fixture
def extract(ogmkit, plan_shards, tmp_path):
    """Extract two scenes of 16 frames to a folder or URL."""
    cache = ("--cache-dir", tmp_path / "masks")
    return lambda out: ogmkit(
        "extract", plan_shards.parent / "world", out, "--camera", "CAM_FRONT", *GRID, *cache
    )


def objects(store, folder="world/shards"):
    """Name → SHA-256 of all objects."""
    return {
        path.rpartition("/")[2]: hashlib.sha256(store.cat_file(path)).hexdigest()
        for path in store.find(folder)
    }


def test_a_store_holds_what_a_folder_does(store, extract, ogmkit, elsewhere, contents, tmp_path):
    assert extract(tmp_path / "local")[0] == 0
    code, said = extract("s3://world/shards")
    assert code == 0, said
    assert objects(store) == contents(tmp_path / "local")
    for machine in ("this", "other"):
        elsewhere(machine)
        assert "2 were there" in extract("s3://world/shards")[1]
    code, said = ogmkit("verify", "s3://world/shards/")
    assert (code, said.splitlines()[-1].endswith("sound")) == (0, True)


def test_groups_are_added_there(store, extract, ogmkit, elsewhere, contents, tmp_path):
    for out in (tmp_path / "local", "s3://world/shards"):
        assert extract(out)[0] == 0
        elsewhere()
        assert ogmkit("homography-fit", out, "--method", "surface")[0] == 0
    assert objects(store) == contents(tmp_path / "local")


def test_a_training_fetches_its_shards_once(store, extract, ogmkit, elsewhere, tmp_path):
    pytest.importorskip("torch")
    assert extract("s3://world/shards")[0] == 0
    elsewhere()
    folder = open_mirror("s3://world/shards")
    assert {path.name for path in folder.iterdir()} == {"manifest.json"}
    few = ("--batch-size", "2", "--max-steps", "2", "--out", tmp_path / "run")
    code, said = ogmkit("train", "lstm-ed", "s3://world/shards", *few)
    assert code == 0, said
    inodes = {path.name: path.stat().st_ino for path in folder.iterdir()}
    assert inodes.keys() == {"manifest.json", "scene-0001.h5", "scene-0002.h5"}
    assert ogmkit("train", "lstm-ed", "s3://world/shards", "--overwrite", *few)[0] == 0
    assert {path.name: path.stat().st_ino for path in folder.iterdir()} == inodes


@pytest.mark.parametrize("arrived", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_a_line_cut_in_mid_upload_leaves_whole_shards_and_the_same_command_resumes(
    store, extract, line, contents, tmp_path, arrived
):
    assert extract(tmp_path / "local")[0] == 0
    whole = contents(tmp_path / "local")
    first = (tmp_path / "local/scene-0001.h5").stat().st_size
    with line.cut(30_000 + arrived * first):
        code, said = extract("s3://world/shards")
    assert code == 1
    assert "can't be written: s3://world/shards" in said.splitlines()[-1]
    there = objects(store)
    assert there.pop(".ogmkit-extract.json")
    assert [(name, whole[name]) for name in sorted(there)] == sorted(there.items())
    assert list(there) == ["scene-0001.h5"][:arrived]
    code, said = extract("s3://world/shards")
    assert (code, "1 were there" in said) == (0, arrived == 1)
    assert objects(store) == whole


def test_what_changes_there_is_seen_here(store, extract, ogmkit):
    assert extract("s3://world/shards")[0] == 0
    path = "world/shards/scene-0001.h5"
    data = bytearray(store.cat_file(path))
    data[len(data) // 2] ^= 1
    store.pipe_file(path, bytes(data))
    code, said = ogmkit("verify", "s3://world/shards")
    assert code == 1
    assert "scene-0001.h5: has another checksum than the manifest says" in said
    store.rm_file(path)
    assert "scene-0001.h5: is missing" in ogmkit("verify", "s3://world/shards")[1]
    assert "1 were there" in extract("s3://world/shards")[1]
    assert ogmkit("verify", "s3://world/shards")[0] == 0


def test_a_shard_that_is_gone_is_named(store, extract, elsewhere):
    assert extract("s3://world/shards")[0] == 0
    elsewhere()
    folder = open_mirror("s3://world/shards")
    entry = read_manifest(folder).shards[0]
    store.rm_file(f"world/shards/{entry.file}")
    with pytest.raises(Exception, match=r"scene-0001.h5: is absent"):
        listed_shard(folder, entry)


def test_a_file_is_removed_there_too(store):
    folder = open_mirror("s3://world/marks")
    write_json(folder / "a.json", [1])
    assert json.loads(store.cat_file("world/marks/a.json")) == [1]
    remove(folder / "a.json")
    remove(folder / "a.json")
    assert not store.exists("world/marks/a.json")
    assert list(folder.iterdir()) == []


def test_what_a_killed_upload_left_is_made_again(store):
    folder = open_mirror("s3://world/marks")
    write_json(folder / "a.json", [1])
    (folder / "a.json").write_text("[2]")  # in its place, but the store doesn't know it
    (folder.parent / "keys" / "a.json").unlink()
    assert json.loads((open_mirror("s3://world/marks") / "a.json").read_text()) == [1]


@pytest.mark.slow
def test_a_large_file_in_parts_is_whole_or_absent(store, line, tmp_path):
    folder = open_mirror("s3://world/large")
    part = tmp_path / "part"
    part.write_bytes(os.urandom(1 << 20) * 120)
    mirror = mirror_of(folder)
    with (
        line.cut(70 << 20),
        pytest.raises(OSError, match="s3://world/large"),
        mirror.publishing(part, "large.h5"),
    ):
        pytest.fail("it has not gone there")
    assert store.find("world/large") == []
    with mirror.publishing(part, "large.h5"):
        pass
    assert store.size("world/large/large.h5") == 120 << 20


@pytest.mark.parametrize(
    ("url", "error", "message"),
    [
        ("gs://bucket/shards", SettingsError, "s3://BUCKET/FOLDER"),
        ("s3://", SettingsError, "s3://BUCKET/FOLDER"),
        ("s3://b//shards", SettingsError, "s3://BUCKET/FOLDER"),
    ],
)
def test_other_urls_are_refused(url, error, message):
    with pytest.raises(error, match=message):
        open_mirror(url)


def test_a_store_that_is_not_reached_is_a_line(store, line, ogmkit):
    with line.cut(0):
        code, said = ogmkit("verify", "s3://world/shards")
    assert code == 1
    assert "see that the store can be reached" in said.splitlines()[-1]


def test_an_absent_folder_holds_no_shards(store, ogmkit):
    code, said = ogmkit("verify", "s3://world/nothing")
    assert (code, "holds no shards" in said) == (1, True)
    code, said = ogmkit("inspect", "s3://nowhere/nothing")
    assert code == 1


def test_without_the_extra_the_remedy_is_a_line(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "s3fs", None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "s3fs" else name)
    with pytest.raises(MissingPackageError, match=r"pip install 'ogmkit\[remote\]'"):
        open_mirror("s3://world/shards", cache_dir=tmp_path)


def test_other_folders_are_no_mirrors(tmp_path):
    assert mirror_of(tmp_path) is None
    (tmp_path / "files").mkdir()
    assert mirror_of(tmp_path / "files") is None
    (tmp_path / "mirror.json").write_text("[]")
    assert mirror_of(tmp_path / "files") is None
    (tmp_path / "mirror.json").write_text('{"url": "s3://a/b"}')
    assert mirror_of(tmp_path / "files") == Mirror("s3://a/b", Path(tmp_path / "files"))
