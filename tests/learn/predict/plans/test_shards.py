import json
import shutil

import h5py
import numpy as np
import pytest
import torch

from ogmkit.errors import CheckpointError, OutputError, SettingsError, ShardError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.plans.objects import PlanJob, drawn, json_list, plan_object, write_list
from ogmkit.learn.predict.plans.shards import plans_of_shards
from ogmkit.learn.predict.run import open_run
from ogmkit.metrics.plan import Plan
from ogmkit.samples.index import index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.reader import Shard

GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
CAMERAS = ("CAM_FRONT",)
SYSTEMS = {
    "lstm-ed": {},
    "end-to-end": {"no_past": True},
    "mid-to-end": {},
    "holistic": {"warp": "surface"},
    "holistic-cv": {},
}
SCENES = ("scene-0001", "scene-0002")
FIRST, LAST = 6, 9
"""Of sixteen frames, those with six before and six after."""
PLAN = Plan(
    mean=np.array([[4.0, 0.5], [8.0, 1.0], [12.0, 1.5], [16.0, 2.0], [20.0, 3.0]]),
    sigma=np.array([[0.5, 0.1], [1.0, 0.2], [1.5, 0.4], [2.0, 0.8], [3.0, 1.5]]),
    rho=np.array([0.0, 0.9, -0.6, 0.3, -0.99]),
)


@pytest.fixture(scope="module")
def runs(tmp_path_factory, make_run):
    """System → RUN."""
    folder = tmp_path_factory.mktemp("runs")
    return {
        system: make_run(folder / system, system, GRID, CAMERAS, **more) for system, more in SYSTEMS.items()
    }


@pytest.fixture
def copied(tmp_path, plan_shards):
    return shutil.copytree(plan_shards, tmp_path / "shards")


def found(run, shards, *, samples=0, seed=0, **more):
    return list(plans_of_shards(PlanJob(run, samples, seed, batch_size=3), shards, **more).objects)


def spoil(shards, name, frame, value=np.nan, scene="scene-0002"):
    with h5py.File(shards / f"{scene}.h5", "r+") as h5:
        row = h5[f"CAM_FRONT/{name}"][frame]
        row.reshape(-1)[-2:] = value
        h5[f"CAM_FRONT/{name}"][frame] = row


@pytest.mark.sampled(2)
@pytest.mark.parametrize("system", SYSTEMS)
def test_objects_hold_what_is_planned(plan_shards, runs, system):
    told = []
    stream = plans_of_shards(
        PlanJob(runs[system], batch_size=3), plan_shards, on_progress=lambda *counts: told.append(counts)
    )
    objects = list(stream.objects)
    warped = system == "holistic"
    assert stream.name == ("end-to-end-np" if system == "end-to-end" else system)
    assert stream.homography == ("surface" if warped else None)
    assert (stream.count, len(objects), told[-1]) == (8, 8, (8, 8))
    run = open_run(runs[system])
    needs = SampleSpec(trajectory=True)
    index = index_sequences(plan_shards, SCENES, CAMERAS, needs=needs, valid_only=False)
    expected = run.plans(index, run.warps_by(None), batch_size=8, workers=0)
    for one, planned in zip(objects, expected, strict=True):
        place = one["scene"], one["camera"], one["frame"]
        assert place == (planned.scene, planned.camera, planned.frame)
        assert one.get("homography_valid") == ([True] * 6 if warped else None)
        assert "samples" not in one
        assert [point["t_s"] for point in one["plan"]] == [0.5, 1.0, 1.5, 2.0, 2.5]
        names = ("x", "y", "sigma_x", "sigma_y", "rho")
        values = np.array([[point[name] for name in names] for point in one["plan"]])
        # Not exactly: batches of another size are multiplied in another order.
        np.testing.assert_allclose(values[:, :2], planned.plan.mean, atol=1e-4)
        np.testing.assert_allclose(values[:, 2:4], planned.plan.sigma, rtol=1e-4)
        np.testing.assert_allclose(values[:, 4], planned.plan.rho, atol=1e-4)
        with Shard(plan_shards / f"{planned.scene}.h5") as shard:
            row = slice(planned.frame, planned.frame + 1)
            assert (one["sample_token"],) == shard.strings("CAM_FRONT", "sample_token", row)
            assert one["timestamp_us"] == shard.dataset("CAM_FRONT", "timestamp_us")[planned.frame]
            future = shard.dataset("CAM_FRONT", "trajectory/future")[planned.frame]
        assert one["destination"] == future[5].tolist()
    assert [one["frame"] for one in objects] == [*range(FIRST, LAST + 1)] * 2


def test_sequences_can_be_chosen(plan_shards, runs):
    for choice, expected in (
        (Choice(splits=("val",)), [("scene-0002", frame) for frame in range(FIRST, LAST + 1)]),
        (Choice(("scene-0001",), limit=2), [("scene-0001", 6), ("scene-0001", 8)]),
        (Choice(limit=2, cameras=CAMERAS), [("scene-0001", 6), ("scene-0002", 6)]),
    ):
        objects = found(runs["lstm-ed"], plan_shards, choice=choice)
        assert [(one["scene"], one["frame"]) for one in objects] == expected


def test_drawn_points_follow_the_gaussians_and_not_each_other():
    points = drawn(PLAN, 200_000, np.random.default_rng(1))
    assert points.shape == (200_000, 5, 2)
    np.testing.assert_allclose(points.mean(axis=0), PLAN.mean, atol=0.02)
    standard = ((points - PLAN.mean) / PLAN.sigma).reshape(-1, 10)
    expected = np.eye(10)
    for step, rho in enumerate(PLAN.rho):
        expected[2 * step, 2 * step + 1] = expected[2 * step + 1, 2 * step] = rho
    np.testing.assert_allclose(np.cov(standard.T), expected, atol=0.01)


def test_a_seed_fixes_what_is_drawn_whatever_the_batches(plan_shards, runs):
    first, again, other = (
        [one["samples"] for one in found(runs["lstm-ed"], plan_shards, samples=4, seed=seed)]
        for seed in (5, 5, 6)
    )
    assert np.shape(first) == (8, 4, 5, 2)
    assert first == again
    assert (np.array(first) != np.array(other)).all()
    whole = plans_of_shards(PlanJob(runs["lstm-ed"], 4, 5, batch_size=8), plan_shards).objects
    np.testing.assert_allclose([one["samples"] for one in whole], first, atol=1e-5)


def test_a_plan_and_its_samples_are_plain_json():
    one = plan_object(PLAN, np.array([25.0, 4.0]), 0.5, 2, np.random.default_rng(0))
    assert json.loads(json.dumps(one)) == one
    assert one["plan"][1] == {"t_s": 1.0, "x": 8.0, "y": 1.0, "sigma_x": 1.0, "sigma_y": 0.2, "rho": 0.9}


def test_a_list_has_an_object_a_line_and_begins_with_the_first():
    objects = [{"scene": "ä\n"}, {"frame": 1}, {}]
    text = "".join(json_list(objects))
    assert json.loads(text) == objects
    assert len(text.splitlines()) == 3
    assert json.loads("".join(json_list([]))) == []

    def failing():
        raise ShardError("damaged")
        yield {}

    parts = []
    with pytest.raises(ShardError):
        parts.extend(json_list(failing()))
    assert parts == []


def test_plans_are_made_while_they_are_read(plan_shards, runs):
    told = []
    stream = plans_of_shards(
        PlanJob(runs["lstm-ed"]), plan_shards, on_progress=lambda *counts: told.append(counts)
    )
    assert told == []
    next(stream.objects)
    assert told == [(1, 8)]


def test_an_interrupted_list_stays_as_it_was(tmp_path):
    def interrupted():
        yield {"frame": 1}
        raise KeyboardInterrupt

    path = tmp_path / "plans.json"
    path.write_text("what was there")
    with pytest.raises(KeyboardInterrupt):
        write_list(path, interrupted())
    assert [file.read_text() for file in tmp_path.iterdir()] == ["what was there"]
    write_list(path, [{"frame": 1}])
    assert json.loads(path.read_text()) == [{"frame": 1}]
    with pytest.raises(OutputError, match=r"absent/plans\.json: can't be written"):
        write_list(tmp_path / "absent" / "plans.json", [])


@pytest.mark.parametrize(
    ("name", "frame", "named"),
    [
        ("global_from_ego", FIRST - 5, FIRST - 5),
        ("level_from_global", LAST, LAST),
        ("trajectory/future", 7, 7),
        ("trajectory/past", 8, 8),
    ],
)
def test_numbers_that_are_none_are_named_before_anything_is_planned(copied, runs, name, frame, named):
    spoil(copied, name, frame)
    expected = (
        rf"scene-0002.h5: CAM_FRONT frame {named}: its \w+ \({name}\) holds a number that is not finite"
    )
    with pytest.raises(ShardError, match=expected):
        plans_of_shards(PlanJob(runs["lstm-ed"]), copied)


def test_poses_of_no_sequence_may_be_anything(copied, runs):
    spoil(copied, "global_from_ego", FIRST - 6)
    spoil(copied, "global_from_ego", LAST + 1)
    assert len(found(runs["lstm-ed"], copied)) == 8


def test_a_waiting_car_s_destination_is_data(copied, runs):
    spoil(copied, "trajectory/future", LAST, 0.0)
    *_, last = found(runs["lstm-ed"], copied)
    assert last["destination"] == [0.0, 0.0]
    assert np.isfinite([[point["x"], point["sigma_y"]] for point in last["plan"]]).all()


def test_images_without_a_homography_are_marked(copied, runs):
    with h5py.File(copied / "scene-0001.h5", "r+") as h5:
        h5["CAM_FRONT/homography/surface/valid"][2] = False
        h5["CAM_FRONT/homography/surface/bev_from_image"][2] = np.nan
    objects = found(runs["holistic"], copied, choice=Choice(("scene-0001",)))
    assert [one["homography_valid"] for one in objects] == [
        [True, False, True, True, True, True],  # frames 1 to 6
        [False, True, True, True, True, True],
        [True] * 6,
        [True] * 6,
    ]


def test_a_network_that_gives_no_numbers_is_refused(tmp_path, plan_shards, make_run):
    run = make_run(
        tmp_path / "run", "lstm-ed", GRID, CAMERAS, lambda net: next(net.parameters()).fill_(torch.nan)
    )
    with pytest.raises(
        CheckpointError, match=r"best.ckpt: its plan for scene-0001 CAM_FRONT frame 6 is not fin"
    ):
        found(run, plan_shards)


def test_wrong_input_is_named_before_anything_is_planned(tmp_path, plan_shards, runs, make_run):
    lstm = PlanJob(runs["lstm-ed"])
    masks = make_run(tmp_path / "footprints", "footprints", GRID, CAMERAS)
    other = make_run(tmp_path / "other", "lstm-ed", GridSpec(1.0, 40, 30, 40.0, 17.0), CAMERAS)
    for job, more, error, message in (
        (PlanJob(masks), {}, CheckpointError, "is a run of footprints, which plans nothing"),
        (PlanJob(other), {}, SettingsError, "was trained on another grid"),
        (lstm, {"homography": "surface"}, SettingsError, "lstm-ed warps nothing; leave out --homography"),
        (
            PlanJob(runs["holistic"]),
            {"homography": "network"},
            ShardError,
            "has no homography 'network' .*; run `ogmkit predict homography",
        ),
        (lstm, {"choice": Choice(("scene-1",))}, SettingsError, "unknown scene 'scene-1'"),
        (lstm, {"choice": Choice(splits=("test",))}, SettingsError, "unknown split 'test'"),
        (lstm, {"choice": Choice(cameras=("CAM_TOP",))}, SettingsError, "unknown camera 'CAM_TOP'"),
    ):
        with pytest.raises(error, match=message):
            plans_of_shards(job, plan_shards, **more)


def test_scenes_without_a_whole_sequence_are_named(learn_shards, runs):
    with pytest.raises(TrainingError, match=r"none of 16 frames can be used .*0 have a valid trajectory"):
        plans_of_shards(PlanJob(runs["lstm-ed"]), learn_shards)


@pytest.mark.parametrize("name", ["samples", "seed"])
def test_negative_numbers_are_refused(runs, name):
    with pytest.raises(SettingsError, match=f"{name}: -1 is negative"):
        PlanJob(runs["lstm-ed"], **{name: -1})
