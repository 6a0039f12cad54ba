"""Trained planners in the second table: as their plans say, worked out here a second time."""

import h5py
import numpy as np
import pytest
import torch

from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.learn.predict.plans.inference import require_finite_plan
from ogmkit.learn.predict.run import open_run
from ogmkit.metrics.plan import Plan
from ogmkit.samples.index import index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import read_manifest

CAMERAS = ("CAM_FRONT",)


@pytest.fixture(scope="module")
def runs(tmp_path_factory, plan_shards, make_run):
    grid = read_manifest(plan_shards).settings.targets.grid
    folder = tmp_path_factory.mktemp("runs")
    chosen = {
        "mid-to-end": {"no_past": True},
        "holistic": {"warp": "surface"},
        "footprints": {},
        "homography": {},
    }
    return {
        name: make_run(folder / name, name, grid, CAMERAS, masks="surface", **more)
        for name, more in chosen.items()
    }


def test_runs_go_to_the_table_of_their_stage(runs):
    outputs = {name: open_run(path).output for name, path in runs.items()}
    assert outputs == {
        "mid-to-end": "plan",
        "holistic": "plan",
        "footprints": "grids",
        "homography": "homography",
    }


def test_figures_are_those_of_the_plans(runs, plan_shards):
    found = evaluate_plans(plan_shards, [open_run(runs["mid-to-end"]), open_run(runs["holistic"])])
    assert found.systems == ("mid-to-end-np", "holistic")
    shown = {(one.system, one.metric, one.horizon_s, one.reading): one.value for one in found.figures}
    with h5py.File(plan_shards / "scene-0002.h5", locking=False) as h5:
        future = h5["CAM_FRONT/trajectory/future"][:]
    for name, system in (("mid-to-end", "mid-to-end-np"), ("holistic", "holistic")):
        needs = SampleSpec(trajectory=True)
        index = index_sequences(plan_shards, ("scene-0002",), CAMERAS, needs=needs, valid_only=False)
        source = "surface" if name == "holistic" else None
        plans = list(open_run(runs[name]).plans(index, source, batch_size=8, workers=0))
        errors = np.stack([plan.plan.mean - future[plan.frame, :5] for plan in plans])
        away = np.linalg.norm(errors, axis=-1)
        assert shown[system, "ade", 2.5, "at"] == pytest.approx(away[:, 4].mean())
        assert shown[system, "ade", 2.5, "mean"] == pytest.approx(away.mean())
        assert shown[system, "l1_lateral", 1.5, "at"] == pytest.approx(np.abs(errors[:, 2, 1]).mean())
        assert shown[system, "l1_longitudinal", 0.5, "mean"] == pytest.approx(np.abs(errors[:, 0, 0]).mean())


def test_a_planner_that_is_not_told_is_scored_up_to_its_last_point(tmp_path, plan_shards, make_run):
    grid = read_manifest(plan_shards).settings.targets.grid
    run = make_run(tmp_path / "run", "lstm-ed", grid, CAMERAS, no_destination=True)
    found = evaluate_plans(plan_shards, [open_run(run)])
    needs = SampleSpec(trajectory=True)
    index = index_sequences(plan_shards, ("scene-0002",), CAMERAS, needs=needs, valid_only=False)
    plans = list(open_run(run).plans(index, None, batch_size=8, workers=0))
    with h5py.File(plan_shards / "scene-0002.h5", locking=False) as h5:
        future = h5["CAM_FRONT/trajectory/future"][:]
    away = np.linalg.norm([plan.plan.mean - future[plan.frame] for plan in plans], axis=-1)

    shown = {
        (one.metric, one.horizon_s, one.definition): one.value
        for one in (*found.figures, *found.named)
        if one.system == "lstm-ed-nd" and one.reading in ("mean", "at")
    }
    assert shown["l2", 3.0, "uniad"] == pytest.approx(away[:, 5].mean())
    assert shown["l2", 3.0, "vad"] == pytest.approx(away.mean())
    assert shown["ade", 2.5, "paper"] == pytest.approx(away[:, :5].mean())  # the last reading is the mean


def test_a_homography_that_the_shards_lack_is_named_with_its_command(runs, plan_shards):
    with pytest.raises(SettingsError, match="ogmkit predict homography"):
        evaluate_plans(plan_shards, [open_run(runs["holistic"])], EvaluateSettings(homography="network"))


def test_a_network_that_gives_no_numbers_is_named(tmp_path, plan_shards, make_run):
    grid = read_manifest(plan_shards).settings.targets.grid
    run = make_run(
        tmp_path / "run", "lstm-ed", grid, CAMERAS, lambda net: next(net.parameters()).fill_(torch.nan)
    )
    message = r"best.ckpt: its plan for scene-\d+ CAM_FRONT frame \d+ is not finite"
    with pytest.raises(CheckpointError, match=message):
        evaluate_plans(plan_shards, [open_run(run)])


@pytest.mark.parametrize("part", ["mean", "sigma", "rho"])
def test_every_part_of_a_plan_must_be_finite(runs, part):
    run = open_run(runs["mid-to-end"])
    parts = {"mean": np.zeros((5, 2)), "sigma": np.ones((5, 2)), "rho": np.zeros(5)}
    require_finite_plan(run, Plan(**parts), "here")
    parts[part][3] = np.nan
    with pytest.raises(CheckpointError, match="its plan for here is not finite"):
        require_finite_plan(run, Plan(**parts), "here")
