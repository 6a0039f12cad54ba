"""What runs and checkpoints say of themselves."""

import pytest

from ogmkit.errors import CheckpointError, TableError
from ogmkit.grid import GridSpec
from ogmkit.learn.figures import Figure
from ogmkit.learn.run_summary import (
    is_checkpoint,
    is_run,
    summarise_checkpoint,
    summarise_run,
)

GRID = GridSpec(0.5, 60, 40, 60.0, 15.0)


@pytest.fixture
def run(tmp_path, make_run):
    folder = make_run(tmp_path / "run", "lstm-ed", GRID, ("CAM_BACK",), hidden=32)
    (folder / "config.yaml").write_text("system: lstm-ed\nlr: 0.5\ncameras: [CAM_BACK]\n")
    (folder / "splits.json").write_text('{"train": ["a", "b"], "val": ["c"]}')
    figures = ("epoch,step,name,value", "0,4,val/ade,3.5", "0,4,val/loss,9", "1,8,val/ade,2.5")
    (folder / "metrics.csv").write_text("\n".join(figures) + "\n")
    return folder


def test_a_run_says_what_was_trained_on_what_and_how_far_it_is(run):
    found = summarise_run(run)
    assert (found.system, found.settings) == ("lstm-ed", {"lr": 0.5, "cameras": ["CAM_BACK"]})
    assert found.scenes == {"train": ("a", "b"), "val": ("c",)}
    assert found.checkpoints == ("best.ckpt",)
    assert found.figures == (Figure(1, 8, "val/ade", 2.5), Figure(0, 4, "val/loss", 9.0))


def test_a_checkpoint_says_what_it_is_of(run):
    found = summarise_checkpoint(run / "best.ckpt")
    assert (found.system, found.cameras, found.epoch) == ("lstm-ed", ("CAM_BACK",), 0)
    assert found.grid == {"m_per_cell": 0.5, "rows": 60, "columns": 40, "ego_row": 60.0, "ego_column": 15.0}
    assert found.settings["hidden"] == 32


def test_what_runs_and_checkpoints_look_like(run, tmp_path):
    assert is_run(run)
    assert is_checkpoint(run / "best.ckpt")
    copied = (run / "best.ckpt").rename(run / "renamed.bin")
    assert is_checkpoint(copied)
    assert is_run(run)  # has settings and splits
    (run / "splits.json").unlink()
    assert not is_run(run)
    assert not is_checkpoint(run / "config.yaml")


def test_damaged_figures_are_named(run):
    (run / "metrics.csv").write_text("epoch,step,name,value\n0,4,val/ade,many\n")
    with pytest.raises(CheckpointError, match=r"metrics\.csv: is damaged"):
        summarise_run(run)


@pytest.mark.parametrize("text", ['{"train": [1]}', '["train"]', "{", "[" * 100_000])
def test_odd_splits_are_named(run, text):
    (run / "splits.json").write_text(text)
    with pytest.raises(TableError, match=r"splits\.json"):
        summarise_run(run)
