import re

import pytest
from click.testing import CliRunner
from ogmkit_cli.export import command
from ogmkit_cli.main import main

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
pytest.importorskip("onnx", reason="onnx is not installed: pip install 'ogmkit[onnx]'")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'ogmkit[onnx]'")

from ogmkit.grid import GridSpec
from ogmkit.learn.export.onnx import DEFAULT_OPSET

GRID = GridSpec(0.5, 60, 40, 60.0, 22.0)


def run(*arguments):
    return CliRunner().invoke(main, ["export", *map(str, arguments)])


def test_the_options_have_the_librarys_defaults():
    assert {option.name: option.default for option in command.params}["opset"] == DEFAULT_OPSET


def test_it_tells_what_was_exported_and_how_far_it_is_from_torch(tmp_path, make_run):
    folder = make_run(tmp_path / "run", "footprints", GRID, ("CAM_FRONT",))
    result = run(folder, "--out", tmp_path / "model.onnx")
    assert (result.exit_code, result.stderr) == (0, "")
    assert re.fullmatch(
        r".*model.onnx: footprints, image 64 × 96 → probabilities, \d+\.\d MB, differs from torch by "
        r"\d\.\de-\d\d at most\n",
        result.stdout,
    )
    assert (tmp_path / "model.onnx").is_file()


def test_another_system_takes_one_line(tmp_path, make_run):
    folder = make_run(tmp_path / "run", "ved", GRID, ("CAM_FRONT",), bev_cell_m=1.0)
    result = run(folder, "--out", tmp_path / "model.onnx")
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr == (
        "ogmkit: error: a run of ved can't be exported, only footprints and homography\n"
    )
    assert not (tmp_path / "model.onnx").exists()
