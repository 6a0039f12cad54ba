"""The whole chain on a small dataset."""

import csv
import importlib.util
import json
import shutil

import pytest

from ogmkit.errors import DataFileError, OutputError, TableError
from ogmkit.shards.manifest import file_sha256, read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder
from ogmkit.workflow.chain import plan_chain, run_chain
from ogmkit.workflow.evaluating import WRITERS, EvaluatePlanning
from ogmkit.workflow.reading import read_config
from ogmkit.workflow.steps import Call

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

STEPS = [
    "extract",
    "homography-fit",
    "train homography",
    "predict homography",
    "render-footprints surface",
    "render-footprints network",
    "train footprints",
    "train lstm-ed",
    "train mid-to-end",
    "evaluate perception",
    "evaluate planning",
    "report",
]


@pytest.fixture
def out(finished, tmp_path):
    """A copy of the finished chain."""
    return shutil.copytree(finished, tmp_path / "out")


def pending(config):
    """What is to be done, and why."""
    return {step.name: step.reason for step in plan_chain(config) if step.action != "skip"}


def done(config, **options):
    """Run, and tell which steps were."""
    names = []
    run_chain(
        config, on_step=lambda news: names.append(news.name) if news.state == "done" else None, **options
    )
    return names


def homographies_in(shards):
    """Those of the first shard."""
    with Shard(next(shards.glob("*.h5"))) as shard:
        return shard.added("CAM_FRONT", "homography")


def tables(out):
    return {path.name: path.read_bytes() for path in (out / "tables").iterdir()}


def test_one_folder_holds_everything_and_what_made_it(finished):
    assert {path.name for path in finished.iterdir()} == {
        *("shards", "runs", "tables", "pictures"),
        *("config.yaml", "manifest.json", "report.html"),
    }
    assert verify_folder(finished / "shards") == ()
    assert {path.name for path in (finished / "runs").iterdir()} == {
        *("homography", "footprints", "lstm-ed", "mid-to-end")
    }
    endings = {"md", "csv", "json", "tex"}
    assert set(tables(finished)) == {
        f"{name}.{end}" for name in ("perception", "planning") for end in endings
    }
    steps = json.loads((finished / "manifest.json").read_text())["steps"]
    assert set(steps) == set(STEPS)
    assert all(step["state"] == "done" and step["finished"] for step in steps.values())
    files = [file for step in steps.values() for file in step["files"]]
    assert len(set(files)) == len(files)
    there = {path.relative_to(finished).as_posix() for path in finished.rglob("*") if path.is_file()}
    assert there - set(files) == {"config.yaml", "manifest.json"}
    assert set(files) <= there
    groups = {name: step["groups"] for name, step in steps.items() if step["groups"]}
    assert groups == {
        "homography-fit": ["homography/surface"],
        "predict homography": ["homography/network"],
        "render-footprints surface": ["footprints/surface"],
        "render-footprints network": ["footprints/network"],
    }
    assert steps["train footprints"]["needed"] == {
        "extract": steps["extract"]["identity"],
        "render-footprints network": steps["render-footprints network"]["identity"],
    }
    assert steps["train footprints"]["identity"] == file_sha256(finished / "runs/footprints/best.ckpt")


def test_the_tables_have_the_rows_that_were_asked_for(finished):
    def systems(name):
        with (finished / "tables" / name).open(encoding="utf-8") as file:
            return list(dict.fromkeys(row["system"] for row in csv.DictReader(file)))

    assert systems("perception.csv")[0] == "footprints"
    assert "ceiling-network" in systems("perception.csv")
    assert systems("planning.csv")[:2] == ["lstm-ed", "mid-to-end"]
    assert (finished / "pictures/planning/lstm-ed-plans.png").is_file()


def test_a_page_shows_all_of_it(finished):
    page = (finished / "report.html").read_text(encoding="utf-8")
    sections = ("extracted", "sound", "perception", "planning", "trainings", "frames", "examples")
    assert all(f'<section id="{name}"' in page for name in sections)
    assert "frames of split val, threshold 0.5, masks warped by homography network" in page


def test_a_report_that_is_gone_is_written_again_as_it_was(out, chain_config):
    before = (out / "report.html").read_bytes()
    (out / "report.html").unlink()
    config = chain_config(out)
    assert pending(config) == {"report": "report.html is gone"}
    assert run_chain(config).report == out / "report.html"
    where = str(out).encode()
    assert where in (out / "report.html").read_bytes()
    assert len((out / "report.html").read_bytes()) > len(before) / 2


def test_it_is_done_once(out, chain_config):
    config = chain_config(out)
    assert pending(config) == {}
    assert done(config) == []
    assert done(read_config(out / "config.yaml")) == []


def test_tables_are_about_a_test_where_the_shards_have_one(out, chain_config, copy_scenes):
    config = chain_config(out, planners=["lstm-ed"])
    one, other = "scene-0001", "scene-0002"
    shards = copy_scenes(
        out / "shards", out / "more", {one: ("train", ""), other: ("val", ""), "x": ("test", "")}
    )
    shutil.rmtree(out / "shards")
    shards.rename(out / "shards")
    EvaluatePlanning(config, WRITERS).run(Call(overwrite=False, let_go=bool, advance=lambda *counts: None))

    text = (out / "tables/planning.md").read_text(encoding="utf-8")
    assert "split test: 4 sequences in 1 scene" in text
    assert "checkpoint" not in text
    with (out / "tables/planning.csv").open(encoding="utf-8") as file:
        assert {row["chosen_on_reported"] for row in csv.DictReader(file)} == {"False"}


def test_tables_say_where_what_they_report_chose_the_checkpoint(finished):
    text = (finished / "tables/planning.md").read_text(encoding="utf-8")
    assert "split val: " in text
    assert "which flatters lstm-ed, mid-to-end: " in text
    with (finished / "tables/planning.csv").open(encoding="utf-8") as file:
        told = {row["system"] for row in csv.DictReader(file) if row["chosen_on_reported"] == "True"}
    assert told == {"lstm-ed", "mid-to-end"}


def after(*names):
    first = STEPS.index(names[0])
    return [name for name in STEPS[first:] if name in names]


NEEDS_CLUSTER = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None,
    reason="distributed is not installed: pip install 'ogmkit[cluster]'",
)
CHANGES = [
    ({"workers": 2}, []),
    ({"trainings_at_once": 2}, []),
    pytest.param({"scheduler": "local"}, [], marks=NEEDS_CLUSTER),
    ({"train": {"checkpoint_every": 7}}, []),
    ({"evaluate": {"threshold": 0.25}}, ["evaluate perception"]),
    ({"evaluate": {"limit": 3}}, ["evaluate perception", "evaluate planning"]),
    ({"planners": [{"system": "lstm-ed", "lr": 0.5}, "mid-to-end"]}, ["train lstm-ed", "train mid-to-end"]),
    ({"footprints": {"lr": 0.5}}, ["train footprints", "evaluate perception"]),
    ({"homography": {"head": "four-point", "lr": 0.5}}, [*STEPS[2:4], *STEPS[5:7], STEPS[9]]),
    ({"homography_fit": {"min_points": 6}}, [*STEPS[1:7], STEPS[9]]),
    ({"render_footprints": {"scale": 2}}, [*STEPS[4:7], STEPS[9]]),
    ({"extract": {"min_visibility": 1}}, STEPS),
]


@pytest.mark.parametrize(("changes", "names"), CHANGES)
def test_a_change_does_anew_what_depends_on_it(finished, chain_config, changes, names):
    found = list(pending(chain_config(finished, **changes)))
    planners = ["evaluate planning"] if "planners" in changes else []
    expected = [name for name in (*names, *planners) if name != "report"]
    assert found == expected + ["report"] * bool(expected)


def test_a_planners_learning_rate_trains_that_planner_and_scores_planners(out, chain_config):
    before = tables(out)
    changed = [{"system": "lstm-ed", "lr": 0.5}, {"system": "mid-to-end", "pool_cells": 48}]
    config = chain_config(out, planners=changed)
    assert pending(config) == {
        "train lstm-ed": "lr is 0.5 here but 0.001 there",
        "evaluate planning": "after train lstm-ed",
        "report": "after train lstm-ed",
    }
    assert done(config) == ["train lstm-ed", "evaluate planning", "report"]
    now = tables(out)
    assert {name for name in now if now[name] != before[name]} == {
        f"planning.{ending}" for ending in ("md", "csv", "json", "tex")
    }


def test_trainings_side_by_side_come_out_as_one_after_the_other(out, chain_config):
    before = tables(out)
    planners = ("lstm-ed", "mid-to-end")
    for name in planners:
        shutil.rmtree(out / "runs" / name)
    config = chain_config(out, trainings_at_once=2)
    under_way, most = set(), 0

    def on_step(news):
        nonlocal most
        (under_way.add if news.state == "begun" else under_way.discard)(news.name)
        most = max(most, len(under_way))

    run_chain(config, on_step=on_step)
    assert most == 2
    assert all(tables(out)[name] == before[name] for name in ("planning.csv", "planning.json"))


def test_a_planner_less_is_left_in_place_and_out_of_the_table(out, chain_config):
    config = chain_config(out, planners=["lstm-ed"])
    summary = run_chain(config)
    assert summary.left == (out / "runs/mid-to-end",)
    assert "mid-to-end" not in (out / "tables/planning.csv").read_text()
    assert [path.name for path in (out / "pictures/planning").iterdir()] == ["lstm-ed-plans.png"]
    assert (out / "runs/mid-to-end/best.ckpt").is_file()
    assert set(summary.tables) == set((out / "tables").iterdir())
    assert {path.name for path in summary.pictures} == {
        *("homographies.png", "footprints.png", "lstm-ed-plans.png")
    }


def test_what_is_gone_is_made_again_and_nothing_else(out, chain_config):
    before = tables(out)
    (out / "shards/scene-0001.h5").unlink()
    (out / "tables/planning.md").unlink()
    config = chain_config(out)
    assert pending(config)["extract"] == "shards/scene-0001.h5 is gone"
    shards = [STEPS[0], STEPS[1], STEPS[3], STEPS[4], STEPS[5]]
    assert done(config) == [*shards, "evaluate planning"]
    figures = ("planning.csv", "planning.json")  # the others tell where the runs are
    assert all(tables(out)[name] == before[name] for name in figures)
    assert verify_folder(out / "shards") == ()


def test_other_shards_replace_those_that_are_there(out, chain_config):
    trained = ("homography", "footprints", "planners")
    config = chain_config(out, trained, extract={"min_visibility": 1}, scenes=["scene-0002"])
    assert done(config) == ["extract", "homography-fit", "render-footprints surface", "report"]
    assert verify_folder(out / "shards") == ()
    manifest = read_manifest(out / "shards")
    assert [entry.scene for entry in manifest.shards] == ["scene-0002"]
    assert manifest.settings == config.extract


def test_homographies_of_an_earlier_configuration_stay_out_of_the_table(out, tmp_path, chain_config):
    less = ("homography", "planners")
    assert done(chain_config(out, less)) == ["train footprints", "evaluate perception", "report"]
    assert homographies_in(out / "shards") == ("network", "surface")
    run_chain(chain_config(tmp_path / "new", less))
    for name in ("perception.csv", "perception.json"):
        assert tables(out)[name] == tables(tmp_path / "new")[name]


def test_more_formats_of_tables_are_written_where_they_are_absent(out, chain_config):
    writers = {"txt": lambda evaluation: f"{evaluation.split}\n"}
    config = chain_config(out)
    assert done(config, writers=writers) == ["evaluate perception", "evaluate planning"]
    assert (out / "tables/planning.txt").read_text() == "val\n"
    assert done(config, writers=writers) == []


def test_a_folder_that_is_no_runs_is_refused(tmp_path, finished, world, chain_config):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").touch()
    shards = shutil.copytree(finished / "shards", tmp_path / "shards")
    for out, message in (
        (tmp_path / "full", "holds thesis.tex, and no `ogmkit run` made it"),
        (shards, "is not the manifest of an `ogmkit run`"),
        (world / "out", "lie in one another"),
        (tmp_path / "full" / "thesis.tex", "is a file"),
    ):
        held = sorted(out.parent.rglob("*"))
        for call in (plan_chain, run_chain):
            with pytest.raises(OutputError, match=message):
                call(chain_config(out))
        assert sorted(out.parent.rglob("*")) == held


def test_a_dataset_that_is_not_there_is_named(tmp_path, chain_config):
    with pytest.raises(TableError, match="no such folder"):
        plan_chain(chain_config(tmp_path / "out", data="nowhere"))


def test_a_scene_that_fails_stops_the_chain_after_the_others(tmp_path, world, chain_config):
    data = shutil.copytree(world, tmp_path / "world")
    image = min((data / "samples/CAM_FRONT").iterdir())
    kept = image.read_bytes()
    image.write_bytes(b"")
    config = chain_config(tmp_path / "out", data=str(data))
    with pytest.raises(
        DataFileError, match=r"^extract: 1 of 2 scenes failed, first scene-000\d: .*jpg: image of"
    ):
        run_chain(config)
    assert len(list((tmp_path / "out/shards").glob("*.h5"))) == 1
    image.write_bytes(kept)
    assert pending(config)["extract"] == "was cut short"


def test_the_dataset_is_known_by_its_content(tmp_path, finished, world, chain_config, edit_table):
    data = shutil.copytree(world, tmp_path / "world")
    for path in data.rglob("*.json"):
        path.touch()
    config = chain_config(finished, data=str(data))
    assert pending(config) == {}
    edit_table(data, "scene", lambda records: records[0].update(description="other"))
    assert list(pending(config)) == STEPS
    (tmp_path / "splits.json").write_text(json.dumps({"train": ["scene-0002"], "val": ["scene-0001"]}))
    assert list(pending(chain_config(finished, split_file=str(tmp_path / "splits.json")))) == STEPS


def test_a_copy_of_the_dataset_is_another_only_where_shards_refer_to_it(tmp_path, world, chain_config):
    data = shutil.copytree(world, tmp_path / "world")
    trained = ("homography", "footprints", "planners")
    for images, names in (("bytes", []), ("reference", ["extract", "homography-fit", STEPS[4], "report"])):
        extract, out = {"images": images}, tmp_path / images
        run_chain(chain_config(out, trained, extract=extract))
        assert list(pending(chain_config(out, trained, extract=extract, data=str(data)))) == names
