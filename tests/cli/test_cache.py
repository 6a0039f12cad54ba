import json

import numpy as np
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main
from PIL import Image

from ogmkit.nuscenes.maps import MaskStore


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A folder with two masks and a file of someone else's, named by the environment."""
    folder = tmp_path / "cache"
    for name, shape in (("a", (20, 30)), ("b", (40, 8))):
        Image.fromarray(np.zeros(shape, np.uint8)).save(tmp_path / f"{name}.png")
        MaskStore(folder).open(tmp_path / f"{name}.png")
    (folder / "notes.txt").write_text("mine")
    monkeypatch.setenv("OGMKIT_CACHE_DIR", str(folder))
    return folder


def cache_command(*arguments):
    return CliRunner().invoke(main, ["cache", *arguments])


# Header 64 bytes, then rows of bytes of eight pixels, then one checksum of 4 bytes.
SIZES = {(20, 30): 64 + 20 * 4 + 4, (40, 8): 64 + 40 + 4}


def test_it_shows_place_entries_and_sizes(cache):
    lines = cache_command().stdout.splitlines()
    assert lines[0].split() == ["file", "pixels", "bytes"]
    assert {tuple(line.split()[1:]) for line in lines[1:-1]} == {("20×30", "148"), ("40×8", "108")}
    assert lines[-1] == f"{cache}: 2 decoded map masks, 256 bytes"
    held = json.loads(cache_command("--json").stdout)
    assert (held["folder"], held["bytes"], held["cleared"]) == (str(cache), 256, False)
    assert {tuple(mask["shape"]): mask["bytes"] for mask in held["masks"]} == SIZES


def test_clearing_removes_masks_and_nothing_else(cache):
    (cache / "0123456789abcdef.partial").write_bytes(b"left by a killed run")
    assert cache_command("--clear").stdout == f"{cache}: removed 3 decoded map masks, 276 bytes\n"
    assert {path.name for path in cache.iterdir()} <= {"notes.txt", "decoding.lock"}
    assert (cache / "notes.txt").read_text() == "mine"
    assert cache_command().stdout == f"{cache}: 0 decoded map masks, 0 bytes\n"


def test_damaged_masks_are_shown_without_a_size(cache):
    next(cache.glob("*.mask")).write_bytes(b"?")
    assert any(line.split()[1:] == ["0×0", "1"] for line in cache_command().stdout.splitlines())


def test_a_mask_that_can_t_be_read_is_named_and_no_damage_is_said_of_it(cache):
    path = next(cache.glob("*.mask"))
    path.unlink()
    path.symlink_to(path.name)  # to open it is refused: too many levels of links
    result = cache_command()
    assert result.exit_code == 1
    assert str(path) in result.stderr
    assert "0×0" not in result.stdout
    assert cache_command("--clear").exit_code == 0
    assert not path.is_symlink()


def test_a_folder_that_is_not_there_is_empty_and_stays_away(tmp_path):
    for arguments in ([], ["--clear"]):
        result = cache_command("--cache-dir", str(tmp_path / "none"), *arguments)
        assert result.exit_code == 0
        assert "0 decoded map masks" in result.stdout
    assert not (tmp_path / "none").exists()


def test_a_file_in_the_folder_s_place_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("OGMKIT_CACHE_DIR", str(tmp_path / "file"))
    result = cache_command()
    assert result.exit_code == 1
    assert result.stderr.startswith(
        f"ogmkit: error: {tmp_path / 'file'}: decoded map masks can't be kept here"
    )
    assert result.stderr.count("\n") == 1
