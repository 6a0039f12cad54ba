"""Whole evaluations, of planners whose plans are known."""

import json
import math
import re
from dataclasses import fields

import h5py
import numpy as np
import pytest

from ogmkit.errors import CheckpointError, OgmkitError, SettingsError
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.planning.fixed import FIXED
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.grid import GridSpec
from ogmkit.metrics.displacement import METRICS, READINGS
from ogmkit.metrics.plan import Plan

SETTINGS = {field.name for field in fields(EvaluateSettings)}


def scored(shards, runs=(), **options):
    """The evaluation, with settings by their names."""
    settings = {name: options.pop(name) for name in SETTINGS & options.keys()}
    return evaluate_plans(shards, runs, EvaluateSettings(**{"samples": 0, **settings}), **options)


def values(evaluation, system, metric):
    """(horizon, reading) → value."""
    return {
        (one.horizon_s, one.reading): one.value
        for one in evaluation.figures
        if (one.system, one.metric) == (system, metric)
    }


@pytest.fixture
def off_by(shards, driven):
    """`off_by(dx, dy, sigma=1)`: plans that are off by so much at every point."""

    def make(dx, dy, sigma=1.0):
        def plan(place):
            mean = driven(shards, place)[:5] + np.array([dx, dy])
            return Plan(mean, np.full((5, 2), sigma), np.zeros(5))

        return plan

    return make


def test_a_planner_whose_checkpoint_was_chosen_here_is_told(shards, fake_planners):
    run, other = fake_planners("run"), fake_planners("other", "end-to-end")
    for one, val in ((run, "scene-0003"), (other, "scene-0009")):
        (one.path / "splits.json").write_text(json.dumps({"train": ["scene-0001"], "val": [val]}))
    found = scored(shards, [run, other])

    assert (found.chosen_on_reported, found.learnt_from_reported) == (("lstm-ed",), ())
    assert [note for note in found.notes if "flatters lstm-ed: " in note]
    assert scored(shards, [run], split="train").learnt_from_reported == ("lstm-ed",)


def test_a_planner_beside_the_rows_for_free(shards, fake_planners, off_by):
    found = scored(shards, [fake_planners("run", plan=off_by(3.0, -4.0))])

    assert (found.split, found.scenes, found.sequences, found.cameras) == ("val", 2, 6, ("CAM_FRONT",))
    assert found.systems == ("lstm-ed",)
    assert found.fixed == FIXED == ("truth", "constant-velocity", "straight-line", "cubic", "linear")
    order = [(one.system, one.metric, one.horizon_s, one.reading) for one in found.figures]
    assert order == [
        (system, metric, horizon_s, reading)
        for system in ("lstm-ed", *FIXED)
        for metric in METRICS
        for horizon_s in (0.5, 1.5, 2.5)
        for reading in READINGS
    ]
    for metric, value in {"ade": 5, "l1_longitudinal": 3, "l1_lateral": 4}.items():
        assert [*values(found, "lstm-ed", metric).values()] == pytest.approx([value] * 6)
    likelihood = math.log(2 * math.pi) + 12.5
    assert [*values(found, "lstm-ed", "nll").values()] == pytest.approx([likelihood] * 6)
    assert set(values(found, "lstm-ed", "inside_90").values()) == {0.0}


def test_the_truth_has_no_errors_and_no_distribution(shards):
    found = scored(shards)

    for metric in ("ade", "l1_longitudinal", "l1_lateral", "off_drivable", "in_vehicle"):
        assert set(values(found, "truth", metric).values()) == {0.0}
    for system in FIXED:
        for metric in ("nll", "inside_50", "inside_90"):
            assert all(math.isnan(value) for value in values(found, system, metric).values())


def test_controls_are_scored_on_the_same_sequences(shards, driven):
    found = values(scored(shards), "straight-line", "ade")

    errors = []
    for scene in ("scene-0002", "scene-0003"):
        for frame in (6, 7, 8):
            future = driven(shards, (scene, "CAM_FRONT", frame))
            line = np.outer(np.arange(1, 6) / 6, future[5])
            errors.append(np.linalg.norm(future[:5] - line, axis=1))
    errors = np.array(errors)
    for horizon_s, points in zip((0.5, 1.5, 2.5), (1, 3, 5), strict=True):
        assert found[horizon_s, "at"] == pytest.approx(errors[:, points - 1].mean())
        assert found[horizon_s, "mean"] == pytest.approx(errors[:, :points].mean())


@pytest.fixture
def rough(shards):
    """The shards, with noise in the training scene: on smooth curves the linear control is exact."""
    with h5py.File(shards / "scene-0001.h5", "r+") as h5:
        future = h5["CAM_FRONT/trajectory/future"]
        future[...] += np.random.default_rng(0).normal(0, 0.1, future.shape)
    return shards


def linear_errors_m(shards, training, evaluated):
    """Mean distance of the points of the pseudo-inverse's linear fit, worked out from plain h5py."""

    def read(scenes):
        rows = []
        for scene in scenes:
            with h5py.File(shards / f"{scene}.h5") as h5:
                past, future = (h5[f"CAM_FRONT/trajectory/{name}"][6:9] for name in ("past", "future"))
            rows.append(np.hstack([past.reshape(3, 12), future.reshape(3, 12)]))
        rows = np.concatenate(rows)
        return rows[:, [*range(12), 22, 23]], rows[:, 12:22]

    (features, points), (new, truth) = read(training), read(evaluated)
    weights = np.linalg.pinv(features - features.mean(0), rcond=1e-6) @ (points - points.mean(0))
    errors = points.mean(0) + (new - features.mean(0)) @ weights - truth
    return np.linalg.norm(errors.reshape(-1, 5, 2), axis=-1).mean()


class TestLinear:
    """The control that is fitted, and never to what it is scored on."""

    @pytest.fixture
    def split(self, tmp_path):
        """`split(train=…, val=…)` writes a split file of scenes' numbers."""

        def write(**scenes):
            path = tmp_path / "splits.json"
            named = {name: [f"scene-000{number}" for number in numbers] for name, numbers in scenes.items()}
            path.write_text(json.dumps(named))
            return path

        return write

    def test_it_is_fitted_to_the_training_split(self, rough):
        found = scored(rough)

        expected = linear_errors_m(rough, ["scene-0001"], ["scene-0002", "scene-0003"])
        assert values(found, "linear", "ade")[2.5, "mean"] == pytest.approx(expected)
        assert 0.01 < expected < 10
        assert found.notes == ("linear: fitted to 3 sequences in 1 scene of split 'train'",)

    @pytest.mark.parametrize("train", [[1], [1, 3], [3, 1]])
    def test_scenes_that_are_evaluated_are_left_out(self, rough, split, train):
        found = scored(rough, split_file=split(train=train, val=[2, 3]))

        expected = linear_errors_m(rough, ["scene-0001"], ["scene-0002", "scene-0003"])
        assert values(found, "linear", "ade")[2.5, "mean"] == pytest.approx(expected)

    def test_scenes_that_a_limit_leaves_out_are_left_out_as_well(self, shards, split):
        found = scored(shards, split_file=split(train=[1, 3], val=[2, 3]), limit=1)

        assert found.notes[0] == "linear: fitted to 1 sequence in 1 scene of split 'train'"

    @pytest.mark.parametrize(
        "splits", [{"train": [2, 3]}, {"train": [], "val": [2]}, {"val": [2]}], ids=["same", "empty", "none"]
    )
    def test_without_another_scene_there_is_none_and_it_is_told(self, shards, split, fake_planners, splits):
        chosen = {"split": "val" if "val" in splits else "train", "split_file": split(**splits)}
        found = scored(shards, [fake_planners("run")], **chosen)

        assert found.fixed == tuple(name for name in FIXED if name != "linear")
        assert {one.system for one in found.figures} == {"lstm-ed", *found.fixed}
        note = "no linear: split 'train' has no sequence to fit it to, other than those of scenes that are "
        assert f"{note}evaluated" in found.notes
        assert "cubic by ADE" in found.notes[-1]

    def test_scenes_without_a_sequence_are_no_error(self, shards):
        with h5py.File(shards / "scene-0001.h5", "r+") as h5:
            h5["CAM_FRONT/trajectory/valid"][:] = False

        assert "linear" not in scored(shards).fixed


def test_intervals_come_from_scenes(shards, fake_planners, driven):
    def plan(place):
        error = 1.0 if place[0] == "scene-0002" else 2.0
        return Plan(driven(shards, place)[:5] + np.array([error, 0]), np.ones((5, 2)), np.zeros(5))

    found = scored(shards, [fake_planners("run", plan=plan)])

    chosen = [one for one in found.figures if (one.system, one.metric) == ("lstm-ed", "ade")]
    for one in chosen:
        assert (one.low, one.value, one.high) == pytest.approx((1.0, 1.5, 2.0))
    assert not any(note.startswith("no confidence intervals") for note in found.notes)


def test_one_scene_is_told(shards, tmp_path):
    path = tmp_path / "splits.json"
    path.write_text(json.dumps({"val": ["scene-0003"]}))

    found = scored(shards, split_file=path)
    assert found.notes[1:] == (
        "no confidence intervals: there is one scene only, and they come from resampling scenes",
    )
    assert all(math.isnan(one.low) and math.isnan(one.high) for one in found.figures)


def test_a_planner_that_does_not_beat_the_controls_is_named(rough, fake_planners, off_by):
    runs = [
        fake_planners("bad", "end-to-end", off_by(50, 0)),
        fake_planners("good", "holistic", off_by(0, 1e-9)),
    ]
    notes = scored(rough, runs).notes

    assert notes[-1:] == (
        "end-to-end does not beat constant-velocity, straight-line, cubic, linear by ADE up to 2.5 s: "
        "no result",
    )


def test_systems_are_named_with_no_past_and_by_their_folder_where_they_share_a_name(shards, fake_planners):
    runs = [
        fake_planners("a", "holistic-np"),
        fake_planners("b", "lstm-ed"),
        fake_planners("truth", "lstm-ed"),
    ]
    found = scored(shards, runs)

    assert found.systems == ("holistic-np", "b", "runs/truth")
    assert found.notes[0] == f"holistic-np: {runs[0].path}"


class TestHomographies:
    """Only a planner that warps needs one."""

    def test_it_is_the_planners_own_unless_another_is_asked_for(self, shards, fake_planners):
        with (
            h5py.File(shards / "scene-0002.h5", "r+") as one,
            h5py.File(shards / "scene-0003.h5", "r+") as two,
        ):
            for h5 in (one, two):
                h5["CAM_FRONT/homography/network/valid"] = np.ones(15, bool)
        warps, does_not = fake_planners("warps", "holistic", warp="surface"), fake_planners("does-not")
        found = scored(shards, [warps, does_not], batch_size=3, workers=1)
        asked = scored(shards, [warps, does_not], homography="network")

        calls = [run.calls for run in (warps, does_not)]
        assert calls == [[("surface", 3, 1), ("network", 8, 0)], [(None, 3, 1), (None, 8, 0)]]
        # Frame 3 has none: it is among the six images of all three sequences of each scene.
        assert found.notes[0] == (
            f"holistic: {warps.path}, masks warped by homography surface; 6 of 6 sequences have images "
            "without one: empty there"
        )
        assert asked.notes[:2] == (
            f"holistic: {warps.path}, masks warped by homography network",
            f"lstm-ed: {does_not.path}",
        )

    def test_one_that_is_missing_is_named_with_its_command(self, shards, fake_planners):
        run = fake_planners("run", "holistic", warp="network")
        message = f"'network' (all have surface); run `ogmkit predict homography {shards} --checkpoint RUN`"
        with pytest.raises(SettingsError, match=re.escape(message)):
            scored(shards, [run])

        scored(shards, [run], homography="surface")
        scored(shards, [fake_planners("other")])


def test_samples_are_spread_over_the_sequences(shards, fake_planners, off_by):
    found = scored(shards, [fake_planners("run", plan=off_by(1, 0))], samples=2)

    assert [(one.system, one.place) for one in found.samples] == [
        ("lstm-ed", ("scene-0002", "CAM_FRONT", 7)),
        ("lstm-ed", ("scene-0003", "CAM_FRONT", 7)),
    ]
    expected = off_by(1, 0)(found.samples[1].place).mean
    np.testing.assert_array_equal(found.samples[1].plan.mean, expected)


def test_limit_and_progress(shards, fake_planners):
    calls = []
    runs = [fake_planners("one"), fake_planners("two")]
    found = scored(shards, runs, limit=2, on_progress=lambda *one: calls.append(one))

    assert found.sequences == 2
    # Rows for free, each run's plans, their scoring, and scores by name.
    assert calls == [(done, 10) for done in range(1, 11)]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"split": "test"}, "unknown split 'test'"),
        ({"cameras": ("CAM_FROND",)}, "CAM_FRONT"),
        ({"limit": 0}, "limit: 0 is below 1"),
    ],
)
def test_bad_settings_are_named_in_one_line(shards, settings, message):
    with pytest.raises(OgmkitError, match=re.escape(message)) as caught:
        scored(shards, **settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        (
            {"grid": GridSpec(0.5, 60, 40, 56, 20)},
            SettingsError,
            "grid.ego_column is 20 here but 24 there",
        ),
        ({"cameras": ("CAM_BACK",)}, SettingsError, "trained without CAM_FRONT; choose --camera CAM_BACK"),
        ({"name": "ved", "output": "grids"}, CheckpointError, "ved plans nothing"),
    ],
    ids=["grid", "camera", "no planner"],
)
def test_runs_that_do_not_fit_are_named(shards, fake_planners, options, kind, message):
    run = fake_planners("run", **options)
    with pytest.raises(kind, match=re.escape(message)) as caught:
        scored(shards, [run])
    assert str(caught.value).startswith(f"{run.path}: ")


def test_a_run_counts_once(shards, fake_planners):
    run = fake_planners("run")
    with pytest.raises(SettingsError, match="is the same checkpoint as"):
        scored(shards, [run, run])
