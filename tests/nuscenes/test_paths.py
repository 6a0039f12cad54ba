import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.errors import TableError
from ogmkit.nuscenes.paths import one_line, resolve


@pytest.mark.parametrize(
    "name", ["samples/CAM_FRONT/a.jpg", "maps/a..b.png", "a b/ü.jpg", "..a/b", "a/.../b"]
)
def test_names_below_the_root(name):
    assert resolve(Path("root"), name) == Path("root") / name


@pytest.mark.parametrize(
    "name", ["", "/etc/passwd", "..", "../a", "a/..", "a/../../b", "C:/a", "a\\b", "a\0", "a\n"]
)
def test_names_that_leave_the_root(name):
    with pytest.raises(TableError, match="not a path inside the dataset"):
        resolve(Path("root"), name)


@given(st.lists(st.sampled_from(["..", ".", "/", "a", "\\", "C:", "", "\0"]), max_size=8).map("".join))
def test_no_name_leads_out(name):
    try:
        path = resolve(Path("/data/root"), name)
    except TableError:
        return
    assert os.path.normpath(path).startswith("/data/root")


def test_links_that_the_user_placed_are_followed(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / "a.jpg").write_bytes(b"123")
    (tmp_path / "root").mkdir()
    (tmp_path / "root" / "samples").symlink_to(tmp_path / "disk")

    assert resolve(tmp_path / "root", "samples/a.jpg").read_bytes() == b"123"


def test_one_line_escapes_controls_and_ends():
    assert one_line("a\nb\x1b[31mü") == "a\\x0ab\\x1b[31mü"
    assert one_line("x" * 500) == "x" * 400 + "…"
