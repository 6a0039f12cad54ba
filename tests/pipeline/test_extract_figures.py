"""An extraction says each figure that is 0 or 100 % throughout."""

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

GRID = ["--cell-size", "1", "--rows", "40", "--columns", "30"]


@pytest.fixture
def notes(tiny_dataroot, tmp_path):
    """What an extraction of a copy of the dataset notes, after `spoil(root)`."""

    def run(spoil, *options):
        root, out = tmp_path / "data", tmp_path / "out"
        root.mkdir()
        for path in tiny_dataroot.iterdir():
            (root / path.name).symlink_to(path)
        spoil(root)
        paths = [str(root), str(out), "--cache-dir", str(tmp_path / "cache")]
        result = CliRunner().invoke(main, ["extract", *paths, *GRID, *options])
        assert result.exit_code == 0, result.output
        lines = [line for line in result.stdout.splitlines() if line.startswith("note ")]
        return [line.removeprefix("note").strip().split(";")[0] for line in lines]

    return run


def _own_copy(root, name):
    """A folder of the dataset's own in place of a link to it."""
    source = (root / name).resolve()
    (root / name).unlink()
    (root / name).mkdir()
    for path in source.iterdir():
        if path.is_file():
            (root / name / path.name).write_bytes(path.read_bytes())
    return root / name


def _masks_of(value):
    def spoil(root):
        for path in _own_copy(root, "maps").glob("*.png"):
            shape = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).shape
            cv2.imwrite(str(path), np.full(shape, value, np.uint8))

    return spoil


def _nothing(root):
    pass


NO_TRAJECTORY = "no frame has a valid trajectory"  # its scenes have eight key frames


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("spoil", "options", "expected"),
    [
        (_nothing, ["--max-gap", "0.01"], [NO_TRAJECTORY]),
        (_masks_of(0), [], ["no cell is drivable throughout", NO_TRAJECTORY]),
        (_masks_of(255), [], ["every cell is drivable throughout", NO_TRAJECTORY]),
        (
            _nothing,
            ["--categories", "static_object.bicycle_rack"],
            ["no cell is under a vehicle throughout", NO_TRAJECTORY],
        ),
    ],
)
def test_figures_that_are_all_or_nothing(notes, spoil, options, expected):
    assert notes(spoil, *options) == expected


def test_a_camera_that_sees_no_cell(notes, edit_table):
    def spoil(root):
        (version,) = root.glob("v1.0-*")
        _own_copy(root, version.name)
        edit_table(root, "calibrated_sensor", _look_up)

    assert "CAM_FRONT sees no cell of the grid" in notes(spoil)


def _look_up(records):
    for record in records:
        if record["camera_intrinsic"]:
            record["rotation"] = [1.0, 0.0, 0.0, 0.0]
