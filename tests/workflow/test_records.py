"""The manifest of a run."""

import json

import pytest

from ogmkit import __version__
from ogmkit.errors import OgmkitError, OutputError, ShardError
from ogmkit.workflow.records import NAME, Record, fingerprint, read_records, write_records

RECORD = Record(
    state="done",
    fingerprint="f",
    settings={"lr": 0.1, "sizes": [1, 2]},
    needed={"extract": "e"},
    identity="i",
    files=("runs/x/best.ckpt",),
    groups=("homography/dlt",),
    note="ade 1.2",
    finished="2024-01-01T00:00:00+00:00",
    seconds=1.5,
)


def test_records_are_read_as_they_were_written(tmp_path):
    assert read_records(tmp_path) == {}
    write_records(tmp_path, {"train x": RECORD})
    assert read_records(tmp_path) == {"train x": RECORD}
    assert json.loads((tmp_path / NAME).read_text())["steps"]["train x"]["package_version"] == __version__
    assert [path.name for path in tmp_path.iterdir()] == [NAME]


def test_a_fingerprint_changes_with_all_that_decides(monkeypatch):
    base = fingerprint({"a": 1, "b": [2]}, {"x": "1"})
    assert base == fingerprint({"b": [2], "a": 1}, {"x": "1"})
    others = [
        fingerprint({"a": 2, "b": [2]}, {"x": "1"}),
        fingerprint({"a": 1, "b": [2]}, {"x": "2"}),
        fingerprint({"a": 1, "b": [2]}, {"y": "1"}),
        fingerprint({"a": 1, "b": [2], "x": "1"}, {}),
    ]
    monkeypatch.setattr("ogmkit.workflow.records.__version__", "0")
    assert len({base, *others, fingerprint({"a": 1, "b": [2]}, {"x": "1"})}) == 6


def changed(**values):
    return lambda content: content["steps"]["s"].update(values)


@pytest.mark.parametrize(
    ("spoil", "error", "message"),
    [
        (lambda content: content.update(format="ogmkit-manifest"), OutputError, "not the manifest of an"),
        (lambda content: content.update(format_version=9), ShardError, "has format 9, not 1"),
        (lambda content: content.pop("steps"), ShardError, "is damaged"),
        (lambda content: content.update(steps=[1]), ShardError, "is damaged"),
        (changed(state="begun"), ShardError, "state 'begun'"),
        (changed(surprise=1), ShardError, "surprise"),
        (changed(files=["../../etc/passwd"]), ShardError, "leaves the folder"),
        (changed(files=["/etc/passwd"]), ShardError, "leaves the folder"),
    ],
)
def test_a_manifest_that_is_no_runs_is_refused(tmp_path, spoil, error, message):
    write_records(tmp_path, {"s": RECORD})
    content = json.loads((tmp_path / NAME).read_text())
    spoil(content)
    (tmp_path / NAME).write_text(json.dumps(content))
    with pytest.raises(error, match=message):
        read_records(tmp_path)


def test_a_manifest_that_is_no_json_is_refused(tmp_path):
    (tmp_path / NAME).write_text("{")
    with pytest.raises(OgmkitError, match="is damaged"):
        read_records(tmp_path)
