"""`check --fix`: what was spoilt comes back as it was, and nothing else changes."""

import codecs
import json
import shutil

import pytest

from ogmkit.errors import OutputError, TableError
from ogmkit.nuscenes.check import check_dataset
from ogmkit.nuscenes.fix import Fixed, fix_tables

FIXED = "v1.0-fixed"


def _tables(folder):
    return {path.name: json.loads(path.read_text(encoding="utf-8")) for path in folder.glob("*.json")}


def _set(**values):
    def change(records):
        for record in records:
            record.update(values)

    return change


def _backslashes(records):
    for record in records:
        record["filename"] = record["filename"].replace("/", "\\")


def _null_ends(records):
    for record in records:
        for link in ("prev", "next"):
            record[link] = record[link] or None


FAULTS = {
    "links of key frames": ("sample", _set(prev="", next=""), "prev", 9),
    "null where a chain ends": ("sample", _null_ends, "next", 2),
    "links of images": ("sample_data", _set(prev=""), "prev", 47),
    "links of annotations": ("sample_annotation", _set(next="gone"), "next", 22),
    "frames of scenes": ("scene", _set(nbr_samples=40), "nbr_samples", 2),
    "first frames": ("scene", _set(first_sample_token="sample-1-3"), "first_sample_token", 2),
    "boxes of instances": ("instance", _set(nbr_annotations=None), "nbr_annotations", 4),
    "last boxes": ("instance", _set(last_annotation_token=""), "last_annotation_token", 4),
    "backslashes": ("sample_data", _backslashes, "filename", 55),
    "backslashes to masks": ("map", _backslashes, "filename", 2),
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("table", "spoil", "column", "count"), FAULTS.values(), ids=FAULTS)
def test_what_was_spoilt_comes_back(small_root, edit_table, table, spoil, column, count):
    sound = _tables(small_root / "v1.0-small")
    edit_table(small_root, table, spoil)
    spoilt = _tables(small_root / "v1.0-small")
    assert spoilt != sound

    fixed = fix_tables(small_root, None, FIXED)

    assert Fixed(table, column, count) in fixed
    assert {one.table for one in fixed} == {table}
    assert _tables(small_root / FIXED) == sound
    assert _tables(small_root / "v1.0-small") == spoilt
    assert check_dataset(small_root, FIXED) == ()


def test_a_byte_order_mark_is_removed(small_root):
    path = small_root / "v1.0-small" / "log.json"
    sound = path.read_bytes()
    path.write_bytes(codecs.BOM_UTF8 + sound)

    assert fix_tables(small_root, "v1.0-small", FIXED) == (Fixed("log", "", 1),)
    assert (small_root / FIXED / "log.json").read_bytes() == sound


def test_where_nothing_is_wrong_nothing_is_written(small_root, real_dataroot, tmp_path):
    assert fix_tables(small_root, None, FIXED) == ()
    assert not (small_root / FIXED).exists()

    shutil.copytree(real_dataroot / "v1.0-mini", tmp_path / "real" / "v1.0-mini")
    assert fix_tables(tmp_path / "real", None, FIXED) == ()


def test_key_frames_of_one_time_are_left_alone(small_root, edit_table):
    def same_time(records):
        for record in records:
            record.update(timestamp=1_500_000_000_000_000, prev="")

    edit_table(small_root, "sample", same_time)

    assert {one.table for one in fix_tables(small_root, None, FIXED)} <= {"scene"}


def test_names_and_folders_that_will_not_do(small_root):
    for name in ("../out", "", ".hidden", "a/b"):
        with pytest.raises(OutputError, match="not a valid folder name"):
            fix_tables(small_root, None, name)
    with pytest.raises(OutputError, match="exists; name a new folder"):
        fix_tables(small_root, None, "samples")
    (small_root / "v1.0-small" / "log.json").write_text("[{")
    with pytest.raises(TableError, match=r"log\.json: cut off"):
        fix_tables(small_root, None, FIXED)
    assert not [path.name for path in small_root.iterdir() if "fixed" in path.name]
