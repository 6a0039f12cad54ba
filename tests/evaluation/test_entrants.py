"""What rows of runs are called."""

from pathlib import Path

import pytest

from ogmkit.evaluation.entrants import names_of

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
