"""The benchmarks of trained networks report scenes that neither taught a network nor chose its checkpoint."""

import importlib
import sys
from pathlib import Path

import pytest

from ogmkit.nuscenes.splits import read_split_file

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

SCENES = {f"scene-{number:04d}": ("", f"{number}") for number in range(40)}


@pytest.fixture
def run_benchmark(tmp_path, monkeypatch, sample_shards, copy_scenes):
    """Run a script on shards of 40 scenes, without its commands; returns its module and split file."""

    def run(name, **replaced):
        monkeypatch.syspath_prepend(Path(__file__).resolve().parents[1] / "benchmarks")
        module = importlib.import_module(name)
        monkeypatch.delitem(sys.modules, name)
        shards = copy_scenes(sample_shards, tmp_path / "shards", SCENES)
        calm = {"make_shards": lambda folder: shards, "ogmkit": lambda *arguments: None}
        calm |= {"train_all": lambda *arguments: trained.append(arguments[2]) or {}, "open_run": str}
        trained = []
        for function, stand_in in (calm | {"as_markdown": str} | replaced).items():
            monkeypatch.setattr(module, function, stand_in)
        monkeypatch.setattr(sys, "argv", [name, str(tmp_path / "bench")])
        module.main()
        (splits,) = set(trained)
        return module, splits

    return run


def sizes(splits):
    return {split: len(scenes) for split, scenes in read_split_file(splits).items()}


def test_perception_is_reported_on_test(run_benchmark):
    reported = []
    module, splits = run_benchmark(
        "perception",
        evaluate=lambda shards, runs, *settings, split_file: reported.append((settings, split_file)),
        homography_table=lambda shards, division: reported.append(division.test),
    )
    assert reported == [((), splits), read_split_file(splits)["test"]]
    assert sizes(splits) == {"train": 40 - module.VAL - module.TEST, "val": module.VAL, "test": module.TEST}
    assert module.WORLD[-2:] == ["--scenes-per-log", 1]


def test_planning_is_reported_on_test(run_benchmark):
    reported = []
    module, splits = run_benchmark(
        "planning",
        sequences_of=lambda shards, split, split_file, **more: reported.append((split, split_file)) or (),
        evaluate_plans=lambda shards, runs, settings, split_file: (
            reported.append((settings.split, split_file)) or type("Found", (), {"samples": ()})
        ),
        pairs_table=lambda sequences, samples: "",
    )
    assert reported == [(None, splits), (None, splits)]
    assert (sizes(splits)["val"], sizes(splits)["test"]) == (module.VAL, module.TEST)
    assert module.WORLD[-2:] == ["--scenes-per-log", 1]
