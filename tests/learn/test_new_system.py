"""A new system takes a record, a class and an entry in the catalogue: commands, files, tables follow."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.learn import catalogue

TOY = Path(__file__).parent / "toy"


@pytest.fixture
def toy(monkeypatch):
    """`toy` is in the catalogue."""
    monkeypatch.syspath_prepend(TOY)
    from toy_system import ToyTraining

    entry = catalogue.SystemEntry(ToyTraining, "toy_system:ToySystem", "grids", "none", "frame → mean map")
    monkeypatch.setitem(catalogue._ENTRIES, "toy", entry)


def run(*arguments):
    return CliRunner().invoke(main, [*map(str, arguments)])


@pytest.mark.usefixtures("toy")
def test_it_is_trained_and_scored_by_the_commands_of_all(plan_shards, tmp_path):
    assert "toy          frame → mean map" in run("train", "--help").stdout
    assert "--start FLOAT" in run("train", "toy", "--help").stdout
    options = ["--lr", "100", "--epochs", "3", "--workers", "0"]
    trained = run("train", "toy", plan_shards, "--out", tmp_path / "toy", *options)
    assert trained.exit_code == 0, trained.stderr
    assert trained.stdout.startswith(f"{tmp_path / 'toy'}: toy, 6 steps on 16 frames, best iou ")
    refused = run("train", "oft", plan_shards, "--start", "1")
    assert "--start is a setting of toy; oft does not read it" in refused.stderr
    scored = run("evaluate", plan_shards, tmp_path / "toy", "--format", "json")
    assert scored.exit_code == 0, scored.stderr
    rows = json.loads(scored.stdout)
    ious = {
        row["system"]: row["value"]
        for row in rows
        if (row["target"], row["region"], row["cells"], row["metric"])
        == ("drivable", "full", "all", "foreground_iou")
        and row["view"] == "bev"
    }
    assert ious["toy"] > 0.9 * ious["mean-map"] > 0


@pytest.mark.usefixtures("toy")
def test_it_is_a_baseline_of_a_run(tmp_path):
    from ogmkit.workflow.reading import config_of

    values = {"data": "world", "out": "out", "train": {"start": 1}, "baselines": ["toy", "oft"]}
    config = config_of(values, tmp_path / "chain.yaml")
    toy, oft = config.baselines
    assert toy.settings.start == 1.0
    assert not hasattr(oft.settings, "start")
    assert config.notes == ()
