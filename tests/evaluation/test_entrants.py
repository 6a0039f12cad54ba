"""What rows of runs are called."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from ogmkit.evaluation.entrants import by_stage, names_of

RESERVED = ("all-drivable", "mean-map")


def paths(*names):
    return [Path("/runs") / name for name in names]


@pytest.mark.parametrize(
    ("names", "systems", "expected"),
    [
        (("a", "b"), ("ved", "oft"), ("ved", "oft")),
        (("a", "b", "c"), ("ved", "oft", "ved"), ("a", "oft", "c")),
        (("x/a", "y/a"), ("ved", "ved"), ("x/a", "y/a")),
        (("x/a", "y/a", "b"), ("ved", "ved", "ved"), ("x/a", "y/a", "b")),
        (("p/x/a", "q/x/a"), ("ved", "ved"), ("p/x/a", "q/x/a")),
        (("ved", "two"), ("ved", "ved"), ("ved", "two")),
        (("oft", "b", "c"), ("ved", "ved", "oft"), ("runs/oft", "b", "oft")),
        (("mean-map", "b"), ("ved", "ved"), ("runs/mean-map", "b")),
    ],
)
def test_names_differ_and_say_as_little_as_they_can(names, systems, expected):
    assert names_of(paths(*names), systems, RESERVED) == expected


def test_checkpoints_are_named_with_their_folder(tmp_path):
    files = [tmp_path / "run" / name for name in ("best.ckpt", "last.ckpt")]
    files[0].parent.mkdir()
    for file in files:
        file.touch()

    assert names_of(files, ("ved", "ved"), ()) == ("run/best.ckpt", "run/last.ckpt")


def test_relative_paths_are_named_by_what_they_mean(tmp_path, monkeypatch):
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    monkeypatch.chdir(tmp_path / "one")

    assert names_of([Path("."), Path("../two")], ("ved", "ved"), ()) == ("one", "two")


def test_runs_are_told_apart_by_what_their_checkpoints_say(monkeypatch):
    def read_checkpoint(file):
        return SimpleNamespace(settings=SimpleNamespace(system=file.parent.name)), {}

    module = ModuleType("ogmkit.learn.checkpoints")
    module.checkpoint_file, module.read_checkpoint = (lambda path: path / "best.ckpt"), read_checkpoint
    monkeypatch.setitem(sys.modules, module.__name__, module)
    given = paths(
        "homography", "holistic", "footprints", "lstm-ed", "ved", "holistic-cv", "mid-to-end", "end-to-end"
    )

    found = by_stage(given)
    assert [path.name for path in found.untabled] == ["homography"]
    assert [path.name for path in found.perceiving] == ["footprints", "ved"]
    assert [path.name for path in found.planning] == [
        "holistic",
        "lstm-ed",
        "holistic-cv",
        "mid-to-end",
        "end-to-end",
    ]
