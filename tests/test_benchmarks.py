"""The benchmarks in parts: what is made, of which scenes, what is told, and how rows are compared."""

import importlib
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ogmkit.metrics.iou import iou
from ogmkit.nuscenes.splits import read_split_file

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
MODULES = (
    "commands", "bench_parts", "bench_command", "bench_data", "bench_grids", "bench_latents", "planning_gain",
    "bench_plans", "result_rows", "comparisons", "perception", "planning", "learn_tables", "plan_tables",
    "assemble", "real_shards", "real_trainings", "real_parts", "real_tables",
)  # fmt: skip


@pytest.fixture
def bench(monkeypatch):
    """The scripts' modules by their names."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    found = SimpleNamespace(**{name: importlib.import_module(name) for name in MODULES})
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name)
    return found


@pytest.fixture
def make_bench(bench, tmp_path):
    """A bench of parts from {name: (settings, needs)}; each tells its settings."""

    def make(content):
        def told(_, part):
            made.append(part.name)
            return {"told": part.settings}

        parts = [
            bench.bench_parts.Part(name, 1, settings, told, needs)
            for name, (settings, needs) in content.items()
        ]
        return bench.bench_parts.Bench(tmp_path / "files", tmp_path / "results", tuple(parts))

    made = make.made = []
    return make


TWO = {"a/data": ({"size": 1}, ()), "a/run": ({"seed": 0}, ("a/data",))}


class TestParts:
    """Each is made once, and again when what it depends on has changed."""

    def test_what_is_told_stays_and_is_not_made_again(self, make_bench):
        found = make_bench(TWO)
        for name in found.missing():
            found.make(name)

        assert make_bench.made == ["a/data", "a/run"]
        assert make_bench(TWO).missing() == []
        record = json.loads((found.results / "a" / "run.json").read_text())
        assert (record["settings"], record["figures"]) == ({"seed": 0}, {"told": {"seed": 0}})
        assert {"commit", "versions", "machine", "wall_s", "cpu_s", "resumed"} <= {*record}

    def test_a_change_is_one_of_all_that_need_it(self, make_bench):
        found = make_bench(TWO)
        for name in found.missing():
            found.make(name)

        run, data = {**TWO, "a/run": ({"seed": 1}, ("a/data",))}, {**TWO, "a/data": ({"size": 2}, ())}
        assert make_bench(run).missing() == ["a/run"]
        assert make_bench(data).missing() == ["a/data", "a/run"]
        assert make_bench(data).record("a/run") is None

    def test_files_are_made_again_only_for_what_reads_them(self, make_bench, tmp_path):
        found = make_bench(TWO)
        for name in found.missing():
            found.make(name)
        told = (tmp_path / "results" / "a" / "data.json").read_text()
        (found.at("a/data") / "made.json").unlink()

        assert found.missing() == []
        (tmp_path / "results" / "a" / "run.json").unlink()
        assert found.missing() == ["a/data", "a/run"]
        found.make("a/data")
        assert (tmp_path / "results" / "a" / "data.json").read_text() == told

    def test_some_may_be_asked_for(self, make_bench):
        found = make_bench({**TWO, "b/data": ({}, ()), "b/run": ({}, ("b/data",))})
        assert found.missing(["b/r"]) == ["b/data", "b/run"]


class TestRunning:
    """Parts in processes of their own."""

    @pytest.fixture
    def run(self, bench, make_bench, monkeypatch, tmp_path):
        """Run parts that write their names down: `run(content, **options)` → those that failed, the names."""
        monkeypatch.setattr(bench.bench_command, "WAIT_S", 0.01)
        log = tmp_path / "log"
        code = "import sys; open(sys.argv[1], 'a').write(sys.argv[2] + ' '); sys.exit('bad' in sys.argv[2])"

        def call(content, **options):
            found = make_bench(content)
            command = [sys.executable, "-S", "-c", code, str(log)]
            failed = bench.bench_command.run_parts(found, found.missing(), command, jobs=2, **options)
            return failed, log.read_text().split() if log.exists() else []

        return call

    def test_a_part_waits_for_what_it_needs(self, run):
        content = {"data": ({}, ()), "one": ({}, ("data",)), "two": ({}, ("one",)), "other": ({}, ())}
        failed, made = run(content)
        assert failed == []
        assert sorted(made) == sorted(content)
        assert made.index("data") < made.index("one") < made.index("two")

    def test_what_needs_a_failed_one_is_left_out_and_the_rest_goes_on(self, run):
        content = {"bad": ({}, ()), "one": ({}, ("bad",)), "two": ({}, ("one",)), "other": ({}, ())}
        failed, made = run(content)
        assert failed == ["bad", "one", "two"]
        assert sorted(made) == ["bad", "other"]

    def test_none_is_started_when_time_is_over(self, run):
        assert run({"data": ({}, ())}, minutes=0) == ([], [])


def all_parts(bench):
    return [*bench.perception.parts_of(toy=False), *bench.planning.parts_of(toy=False)]


def test_parts_are_short_and_come_after_what_they_need(bench):
    for module in (bench.perception, bench.planning):
        for toy in (False, True):
            seen = []
            for part in module.parts_of(toy=toy):
                assert part.name not in seen
                assert {*part.needs} <= {*seen}
                assert part.minutes < 40
                assert json.loads(json.dumps(part.settings)) == part.settings
                seen.append(part.name)


def test_every_world_has_a_log_for_each_scene_and_images_show_what_is_annotated(bench):
    worlds = [part.settings for part in all_parts(bench) if "synthesize" in part.settings]
    many = [240, 20, 40]
    assert [world["split"] for world in worlds] == [[40, 8, 12], [40, 8, 12], many, [80, 8, 24], many]
    for world in worlds:
        options = dict(zip(world["synthesize"], world["synthesize"][1:], strict=False))
        seen = "none" not in world["extract"]
        assert (options["--scenes-per-log"], options["--annotate-by"]) == (1, "rendered" if seen else "all")


def test_masks_are_learnt_with_balanced_classes(bench):
    learnt = [part.settings["train"] for part in all_parts(bench) if "train" in part.settings]
    for system, *options in learnt:
        no_masks = system in ("lstm-ed", "mid-to-end", "homography") or "perception" in options  # frozen
        assert no_masks or options[options.index("--balance") + 1] == "weighted"


def test_a_training_knows_no_scene_that_is_reported(bench, tmp_path, monkeypatch, sample_shards, copy_scenes):
    ran = []
    monkeypatch.setattr(bench.bench_data, "ogmkit_here", lambda *arguments: ran.append(arguments))
    world, run = (
        next(part for part in bench.perception.parts_of(toy=False) if part.name == name)
        for name in ("flat/data", "flat/footprints-1")
    )
    made = bench.bench_parts.Bench(tmp_path / "files", tmp_path / "results", (world, run))
    names = {f"scene-{number:04d}": ("", f"{number}") for number in range(60)}
    made.at(world.name).mkdir(parents=True)
    copy_scenes(sample_shards, made.at(world.name) / "shards", names)

    told = bench.bench_data.make_world(made, world)["scenes"]
    bench.bench_data.train(made, run)

    (splits,) = (
        arguments[1 + arguments.index("--split-file")] for arguments in ran if arguments[0] == "train"
    )
    assert {split: [*scenes] for split, scenes in read_split_file(splits).items()} == told
    assert [len(told[split]) for split in ("train", "val", "test")] == [40, 8, 12]
    assert sorted(scene for scenes in told.values() for scene in scenes) == sorted(names)


class TestComparisons:
    """Differences on the same scenes."""

    def test_of_ious_against_each_rows_own(self, bench):
        random = np.random.default_rng(0)
        one, other = random.integers(1, 99, (2, 7, 4))
        found = bench.comparisons.iou_difference(one, other)
        assert found.value == iou(one.sum(0))[0] - iou(other.sum(0))[0]
        assert found.low < found.value < found.high
        nothing = bench.comparisons.iou_difference(one, one)
        assert (nothing.value, nothing.low, nothing.high) == (0, 0, 0)

    def test_of_means_over_seeds(self, bench):
        random = np.random.default_rng(0)
        numbers = np.broadcast_to(random.integers(1, 9, 6), (3, 6)).astype(float)
        sums = random.random((3, 6)) * numbers
        one, other = (np.stack([part, numbers], axis=-1) for part in (sums + 0.25 * numbers, sums))
        for over_seeds in (False, True):
            found = bench.comparisons.mean_difference(one, other, over_seeds=over_seeds)
            np.testing.assert_allclose([found.value, found.low, found.high], 0.25)
        # Seeds that differ widen the interval only where they are drawn as well.
        one[..., 0] += np.array([-1.0, 0.0, 1.0])[:, None] * numbers
        narrow, wide = (
            bench.comparisons.mean_difference(one, other, over_seeds=over_seeds)
            for over_seeds in (False, True)
        )
        np.testing.assert_allclose([narrow.value, narrow.low, narrow.high, wide.value], 0.25)
        assert wide.low < -0.25 < 0.75 < wide.high

    def test_of_medians(self, bench):
        random = np.random.default_rng(0)
        other = [random.random(9) + 0.1 for _ in range(5)]
        found = bench.comparisons.median_ratio([0.5 * one for one in other], other)
        np.testing.assert_allclose([found.value, found.low, found.high], 0.5)
        exact = [np.zeros(3)]
        assert bench.comparisons.told(bench.comparisons.median_ratio(other[:1], exact), ".2f") == "NA"

    def test_ranges_and_errors_without_bound(self, bench):
        scene = {"range_m": [10.0, 25.0, 39.9, 40.0], "error_m": [1.0, None, 2.0, 3.0]}
        (found,) = bench.comparisons.in_range([scene], 20.0, 40.0)
        assert found.tolist() == [np.inf, 2.0]


class TestPage:
    """What stands in RESULTS.md between the markers."""

    def test_it_is_what_the_results_give(self, bench, tmp_path):
        pages = {tmp_path / one.name: one for one in (bench.assemble.PAGE, bench.assemble.SCALING)}
        for copy, page in pages.items():
            copy.write_text(page.read_text(encoding="utf-8"), encoding="utf-8")
        copied = [str(copy) for copy in pages]
        bench.assemble.main(["--page", copied[0], "--scaling", copied[1]])
        for copy, page in pages.items():
            assert copy.read_text(encoding="utf-8") == page.read_text(encoding="utf-8")

    def test_without_results_every_row_says_so(self, bench, tmp_path):
        for tables in (bench.learn_tables, bench.plan_tables):
            parts = tuple(tables.parts_of(toy=False))
            shown = tables.text(bench.bench_parts.Bench(tmp_path, tmp_path, parts)).splitlines()
            rows = [line for line in shown if line.startswith("| ") and not line.startswith("| ---")]
            headings = [shown[i - 1] for i, line in enumerate(shown) if line.startswith("| ---")]
            assert len(rows) > len(headings) > 2
            assert all("not run yet" in line for line in rows if line not in headings)

    def test_real_images_are_told_of_all_files(self, bench, tmp_path):
        assert bench.real_tables.text(tmp_path) == "Not run yet."
        place = {"target": "drivable", "view": "camera", "region": "full", "cells": "all"}
        figure = {"metric": "foreground_iou", "system": "mean-mask", "start": None, "seed": None}
        (tmp_path / "real").mkdir()
        for train, test, value in (("a", "b", 0.25), ("b", "a", 0.5)):
            records = [{**place, **figure, "train": train, "test": test, "value": value}]
            (tmp_path / "real" / f"{test}.json").write_text(json.dumps(records))
        found = bench.real_tables.text(tmp_path)
        assert "learnt from a, reported on b" in found
        assert "| mean-mask |  | 25.0 |" in found
        assert "| mean-mask |  | 50.0 |" in found

    def test_a_page_without_markers_is_refused(self, bench):
        with pytest.raises(SystemExit, match="is missing"):
            bench.assemble.between("text", "learn", "")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "tables"), [("perception", "learn_tables"), ("planning", "plan_tables")])
def test_the_toy_runs_from_end_to_end(bench, tmp_path, name, tables):
    module, tables = getattr(bench, name), getattr(bench, tables)

    def run():
        folder = ["--folder", str(tmp_path)]
        return bench.bench_command.run_bench(module.NAME, module.parts_of, "", ["--toy", *folder])

    assert run() == 0
    parts = tuple(module.parts_of(toy=True))
    found = bench.bench_parts.Bench(tmp_path, tmp_path / "results", parts)
    assert found.missing() == []
    assert "not run yet" not in tables.text(found)
    for part in parts:
        assert found.record(part.name)["settings"] == part.settings
