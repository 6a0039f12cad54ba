"""What evaluations report by default, and runs that have seen it."""

import json

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.formats import as_csv, as_json, report_of
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.scope import scope_of
from ogmkit.evaluation.seen import seen_by
from ogmkit.evaluation.settings import EvaluateSettings

SETTINGS = EvaluateSettings(samples=0, limit=2)
FLATTERED = "the best checkpoint was chosen on scenes that are reported here, which flatters "
LOGS = {"a": ("train", "1"), "b": ("train", "1"), "c": ("train", "2"), "d": ("train", "3")}


@pytest.fixture
def make(tmp_path, eval_shards, copy_scenes):
    """A folder of scenes: `make({scene: (split, log)})`."""
    return lambda scenes: copy_scenes(eval_shards, tmp_path / "copies", scenes)


@pytest.fixture
def trained(fake_runs):
    """A run that was trained on scenes: `trained(name, {split: scenes})`."""

    def make(name, scenes, system="oft"):
        run = fake_runs(name, system)
        (run.path / "splits.json").write_text(json.dumps(scenes))
        return run

    return make


def scope(shards, split=None, split_file=None):
    return scope_of(
        shards, split=split, split_file=split_file, cameras=(), homography=None, sources=None, limit=None
    )


def test_a_test_is_reported_by_default(make, trained):
    shards = make({"a": ("train", "1"), "b": ("val", "2"), "c": ("test", "3")})
    run = trained("run", {"train": ["a"], "val": ["b"], "test": ["c"]})
    found = evaluate(shards, [run], SETTINGS)

    assert (found.split, scope(shards).scenes, scope(shards).training.scenes) == ("test", ("c",), ("a",))
    assert (found.chosen_on_reported, found.learnt_from_reported) == ((), ())
    assert not [note for note in found.notes if "checkpoint" in note]
    assert scope(shards, "val").scenes == ("b",)


def test_without_a_test_the_line_and_the_records_say_what_chose_the_checkpoint(eval_shards, trained):
    runs = [
        trained("one", {"train": ["scene-0001"], "val": ["scene-0002"]}),
        trained("two", {"train": ["elsewhere"], "val": ["nowhere"]}, "ved"),
    ]
    found = evaluate(eval_shards, runs, SETTINGS)

    assert (found.split, found.chosen_on_reported) == ("val", ("oft",))
    assert report_of(found, all_tables=False).explanations.count(
        f"{FLATTERED}oft: scenes of a split test are for that"
    ) == 1  # fmt: skip
    records = json.loads(as_json(found))
    assert {one["system"] for one in records if one["chosen_on_reported"]} == {"oft"}
    assert not any(one["learnt_from_reported"] for one in records)
    assert as_csv(found).splitlines()[1].endswith(",True,False")
    assert not any(FLATTERED in note for note in evaluate(eval_shards, (), SETTINGS).notes)


def test_normalisation_from_reported_images_is_told(eval_shards, trained):
    runs = [
        trained("one", {"train": ["elsewhere"], "adapted": ["scene-0002", "scene-0001"]}),
        trained("two", {"adapted": ["elsewhere"]}, "ved"),
    ]
    notes = evaluate(eval_shards, runs, SETTINGS).notes

    assert "oft has its normalisation from images, without labels, of 1 scene here" in notes
    assert not any(note.startswith("ved has its normalisation") for note in notes)
    assert any(note.startswith("whether ved has seen these scenes is not known") for note in notes)


def test_without_a_test_but_with_logs_nothing_reported_chose_the_checkpoint(make, trained):
    shards = make(LOGS | {"v": ("val", "4")})
    whole = scope(shards)
    (chosen,) = {*"abcd"} - {*whole.training.scenes}
    run = trained("run", {"train": whole.training.scenes, "val": [chosen], "test": ["v"]})
    found = evaluate(shards, [run], SETTINGS)

    assert (found.split, whole.scenes) == ("test", ("v",))
    assert found.chosen_on_reported == ()
    assert [note for note in found.notes if "val is reported, and 1 of the 4 scenes in train" in note]
    assert scope(shards, "test").scenes == scope(shards, "val").scenes == ("v",)
    assert scope(shards, "train").scenes == ("a", "b", "c", "d")
    assert (scope(shards, "test").note, scope(shards, "train").note) == (whole.note, "")


def test_a_run_that_learnt_from_what_is_reported_is_no_result(make, trained):
    shards = make({"a": ("train", "1"), "b": ("val", "2"), "c": ("test", "3"), "d": ("test", "4")})
    run = trained("run", {"train": ["c", "a", "d"], "val": ["b"]})
    found = evaluate(shards, [run], SETTINGS)

    assert found.learnt_from_reported == ("oft",)
    assert (
        "oft learnt from 2 scenes of these names: no result, unless they are of another dataset; its "
        "splits.json, as --split-file, has others"
    ) in found.notes
    again = evaluate(shards, [run], SETTINGS, split_file=run.path / "splits.json")
    assert (again.split, again.learnt_from_reported, again.chosen_on_reported) == ("val", (), ("oft",))


def test_a_checkpoint_alone_is_not_known(eval_shards, fake_runs):
    found = evaluate(eval_shards, [fake_runs("run", "oft")], SETTINGS)
    assert (
        "whether oft has seen these scenes is not known: there is no splits.json beside the checkpoint"
    ) in found.notes


def test_a_damaged_list_is_named(trained):
    run = trained("run", {"train": "a"})
    with pytest.raises(TableError, match=r"runs/run/splits\.json: split 'train' is not a list"):
        seen_by({"oft": run.checkpoint}, ["a"])


def test_what_can_t_be_reported_is_refused(make, tmp_path):
    shards = make({"a": ("train", "1"), "b": ("dev", "2")})
    with pytest.raises(SettingsError, match="unknown split 'val'; there are: dev, train"):
        evaluate(shards)
    with pytest.raises(SettingsError, match="unknown split 'test'"):
        evaluate(shards, (), EvaluateSettings(split="test"))


def test_planners_are_reported_on_the_same_scenes(make, tmp_path, plan_shards, copy_scenes):
    scenes = {"a": ("train", "1"), "b": ("val", "2"), "c": ("test", "3")}
    shards = copy_scenes(plan_shards, tmp_path / "plans", scenes)
    assert (evaluate_plans(shards).split, evaluate_plans(plan_shards).split) == ("test", "val")
    carved = copy_scenes(plan_shards, tmp_path / "carved", LOGS | {"v": ("val", "4")})
    found = evaluate_plans(carved)
    assert (found.split, found.scenes) == ("test", 1)
    assert found.notes[0].startswith("no split test with boxes: val is reported")
