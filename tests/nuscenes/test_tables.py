import os
import signal
import tempfile
import threading

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.uses import Use
from ogmkit.nuscenes.versions import find_version


def test_the_only_version_is_found(small_root):
    (small_root / "v1.0-notes.txt").touch()

    assert find_version(small_root, None) == "v1.0-small"


def test_any_version_folder_can_be_named(small_root):
    (small_root / "v1.0-small").rename(small_root / "mine")

    with Dataset(small_root, "mine") as dataset:
        assert dataset.version == "mine"
        assert len(dataset.scene("scene-0001", ["CAM_FRONT"]).cameras["CAM_FRONT"]) == 8


def test_several_versions_are_listed(small_root):
    (small_root / "v1.0-trainval").mkdir()

    with pytest.raises(SettingsError, match=r"v1\.0-small, v1\.0-trainval.*--version"):
        find_version(small_root, None)


@pytest.mark.parametrize("version", ["v1.0-test", "", ".", "..", "v1.0-small/../v1.0-small"])
def test_an_unknown_version_lists_those_there_are(small_root, version):
    with pytest.raises(SettingsError, match=r"there are: v1\.0-small"):
        find_version(small_root, version)


@pytest.mark.parametrize(
    ("tables", "given", "remedy"),
    [
        ("sub/v1.0-small", ".", "they lie one folder deeper: give {root}/sub"),
        ("annotation", ".", "annotation/ holds tables: choose it with --version annotation"),
        (
            "v1.0-small",
            "v1.0-small",
            "it is a folder of tables itself: give {root}, with --version v1.0-small",
        ),
    ],
)
def test_where_the_tables_lie_instead_is_told(tmp_path, tables, given, remedy):
    folder = tmp_path / tables
    folder.mkdir(parents=True)
    (folder / "scene.json").write_text("[]")

    with pytest.raises(TableError) as caught:
        find_version(tmp_path / given, None)

    assert str(caught.value).endswith(remedy.format(root=tmp_path))


def test_a_root_without_tables_says_so(tmp_path):
    with pytest.raises(TableError, match=r"holds no v1\.0-… folder"):
        find_version(tmp_path, None)
    with pytest.raises(TableError, match="no such folder"):
        find_version(tmp_path / "absent", None)


WHOLE = b'[{"token": "a", "timestamp": 5}]'
BROKEN = {
    "empty": b"",
    "only spaces": b" \n ",
    "invalid": b'[{"token" "a"}]',
    "cut inside a record": WHOLE[:20],
    "cut after a record": b'[{"token": "a"}',
    "cut after a comma": b'[{"token": "a"},',
    "closed where it was cut": b'[{"token": "a", "timest]',
    "HTML": b"<!DOCTYPE html><html><body>404</body></html>",
    "an object": b'{"token": "a"}',
    "text": b"# tables",
    "numbers": b"[1, 2]",
    "arrays": b"[[1]]",
    "Latin-1": '[{"token": "é"}]'.encode("latin-1"),
    "trailing": WHOLE + b" x]",
    "a key twice": b'[{"token": "a", "token": "b"}]',
}


@pytest.mark.parametrize("table", ["sample", "ego_pose"])
@pytest.mark.parametrize("content", BROKEN.values(), ids=BROKEN)
def test_a_file_that_is_no_table_is_named_with_a_remedy(small_root, table, content):
    path = small_root / "v1.0-small" / f"{table}.json"
    path.write_bytes(content)

    with pytest.raises(TableError) as caught:
        Dataset(small_root)

    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert message.endswith("extract the metadata archive again")
    assert "\n" not in message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"version https://git-lfs.github.com/spec/v1",
            "a git-LFS pointer, not the table itself; run git lfs pull",
        ),
        ('[{"token": "a"}]'.encode("utf-16"), "UTF-16 text; write it as UTF-8"),
        (b"\xef\xbb\xbf" + WHOLE, "begins with a byte-order mark; remove it: ogmkit check --fix"),
    ],
)
def test_what_else_a_table_may_be_has_a_remedy_of_its_own(small_root, content, message):
    path = small_root / "v1.0-small" / "sample.json"
    path.write_bytes(content)

    with pytest.raises(TableError) as caught:
        Dataset(small_root)

    assert str(caught.value) == f"{path}: {message}"


def test_a_missing_table_is_named(small_root):
    (small_root / "v1.0-small" / "log.json").unlink()

    with pytest.raises(TableError, match=r"log\.json: table is missing"):
        Dataset(small_root)


def test_a_folder_in_the_place_of_a_table_is_named(small_root):
    path = small_root / "v1.0-small" / "log.json"
    path.unlink()
    path.mkdir()

    with pytest.raises(TableError, match=r"log\.json: cannot be read"):
        Dataset(small_root)


@pytest.mark.parametrize("table", ["attribute", "visibility"])
def test_tables_that_no_record_is_made_from_may_be_missing(small_root, table):
    (small_root / "v1.0-small" / f"{table}.json").unlink()

    with Dataset(small_root) as dataset:
        assert dataset.scene("scene-0002", ["CAM_BACK"]).name == "scene-0002"


@pytest.mark.parametrize("name", ["a[1]*?", "key=value", "with 'quotes' and spaces", "ünï"])
def test_folders_may_have_any_name(make_dataset, tmp_path, name):
    make_dataset(tmp_path / "axyz")  # what the pattern a[1]*? must not match instead
    root = make_dataset(tmp_path / name)

    with Dataset(root) as dataset:
        assert dataset.scene_names() == ("scene-0001", "scene-0002")


def test_names_that_are_no_utf8_are_refused(small_root, tmp_path):
    with pytest.raises(SettingsError, match=r"'\\udc80': is not valid UTF-8"):
        check_dataset(small_root, use=Use(cameras=("\udc80",)))
    (tmp_path / "\udc80").mkdir()
    root = small_root.rename(tmp_path / "\udc80" / "root")
    with pytest.raises(SettingsError, match="is not valid UTF-8; rename it"), Dataset(root) as dataset:
        dataset.scene_names()


def test_only_key_frames_of_cameras_and_lidar_are_kept(small_root):
    with Tables(small_root / "v1.0-small") as tables:
        for table in ("sensor", "calibrated_sensor", "sample_data", "ego_pose"):
            tables.load(table)
        kept = {token for (token,) in tables.rows("SELECT token FROM sample_data")}
        poses = {token for (token,) in tables.rows("SELECT token FROM ego_pose")}

    assert len(kept) == 3 * (8 + 3)
    assert not any(token.startswith("sweeps") or "RADAR" in token for token in kept)
    assert poses == {f"pose-{token}" for token in kept}


def test_only_needed_columns_are_kept_unless_all_are_asked_for(small_root):
    names = {}
    for complete in (False, True):
        with Tables(small_root / "v1.0-small", complete=complete) as tables:
            tables.load("log")
            names[complete] = {row[0] for row in tables.rows("DESCRIBE log")}

    assert names[False] == {"token", "location"}
    assert names[True] == {"token", "location", "logfile", "vehicle", "date_captured"}


def test_spilled_files_are_removed(small_root, tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))

    with Tables(small_root / "v1.0-small", memory_limit="60MB") as tables:
        tables.execute(
            "CREATE TABLE large AS SELECT md5(i::VARCHAR) || md5((-i)::VARCHAR) FROM range(1_000_000) r(i)"
        )
        assert any((tmp_path / "temporary").iterdir())
    assert not any((tmp_path / "temporary").iterdir())


def test_too_little_memory_is_one_line(small_root):
    with pytest.raises(TableError, match=r"log\.json: Out of Memory.*; free memory or space in ") as caught:
        Dataset(small_root, memory_limit="1MB")
    assert "\n" not in str(caught.value)


def test_an_interrupt_ends_a_query_at_once(small_root):
    """A query of minutes, interrupted in the main thread as by Ctrl-C."""
    with Tables(small_root / "v1.0-small") as tables:
        threading.Timer(0.2, os.kill, [os.getpid(), signal.SIGINT]).start()
        with pytest.raises(KeyboardInterrupt):
            tables.rows("SELECT sum(sin(a.i + b.i)) FROM range(10_000_000) a(i), range(10_000) b(i)")
        assert tables.rows("SELECT 1") == [(1,)]
