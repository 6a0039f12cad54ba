import csv
import os
import shutil
import signal
from dataclasses import replace

import pytest
import torch

from ogmkit.errors import (
    CheckpointError,
    OgmkitError,
    OutputError,
    SettingsError,
    ShardError,
    TrainingError,
)
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import read_checkpoint
from ogmkit.learn.runs import LOCK
from ogmkit.learn.training.train import train
from ogmkit.learn.yaml_files import as_yaml

TINY = {"image_size": (64, 96), "encoder": "tu-test_resnet", "batch_size": 2, "limit_frames": 7, "lr": 1e-3}
SYSTEMS = {
    "homography": {},
    "footprints": {"colour": 0.3, "flip": 0.5},
    "ved": {"bev_cell_m": 1.0},
    "oft": {"channels": 16, "blocks": 1, "flip": 0.5},
    "bev-lidar": {"bev_cell_m": 1.0},
}


CAMERAS = ("CAM_BACK", "CAM_FRONT")
GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)


class Crash(Exception):  # noqa: N818  # stands for a kill
    """Stands for a process that dies between two steps."""


def settings(system="homography", **more):
    entry = CATALOGUE[system]
    common = entry.read(TINY | {"epochs": 3, "workers": 0})
    return entry.settings(**(common | SYSTEMS[system] | more))


def crash_at(step):
    def tell(done, total):
        if done == step:
            raise Crash

    return tell


def weights(run, name="last.ckpt"):
    return read_checkpoint(run / name)[1]["state_dict"]


def same(left, right):
    return left.keys() == right.keys() and all(torch.equal(left[name], right[name]) for name in left)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("system", SYSTEMS)
def test_each_system_trains_and_leaves_a_whole_run(tmp_path, learn_shards, system):
    run = tmp_path / "run"
    told = []
    summary = train(
        settings(system, epochs=1), learn_shards, run, on_progress=lambda *counts: told.append(counts)
    )
    assert (summary.frames, summary.steps, told[-1]) == (7, 4, (4, 4))
    names = {path.name for path in run.iterdir()}
    assert names == {
        "config.yaml",
        "splits.json",
        "metrics.csv",
        "tensorboard",
        "samples.png",
        "last.ckpt",
        "best.ckpt",
    }
    with (run / "metrics.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {"val/loss", f"val/{summary.score_name}"} <= {row["name"] for row in rows}
    assert summary.score == pytest.approx(
        next(float(row["value"]) for row in rows if row["name"] == f"val/{summary.score_name}"), rel=1e-4
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("system", "more", "step"),
    [
        ("homography", {}, 6),
        ("footprints", {"accumulate": 2, "checkpoint_every": 1}, 3),
        ("footprints", {"checkpoint_every": 1, "optimizer": "adamw", "schedule": "cosine"}, 8),
        ("ved", {"checkpoint_every": 2}, 7),
    ],
)
def test_killed_within_an_epoch_and_resumed_the_weights_are_the_same(
    tmp_path, learn_shards, system, more, step
):
    chosen = settings(system, **({"checkpoint_every": 1} | more))
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    train(chosen, learn_shards, whole)
    with pytest.raises(Crash):
        train(chosen, learn_shards, cut, on_progress=crash_at(step))
    summary = train(chosen, learn_shards, cut)
    assert 0 < summary.resumed_step <= step
    assert same(weights(whole), weights(cut))
    assert same(weights(whole, "best.ckpt"), weights(cut, "best.ckpt"))
    for name in ("metrics.csv", "last.ckpt", "best.ckpt"):
        assert (whole / name).read_bytes() == (cut / name).read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_workers_and_interruptions_change_nothing(tmp_path, learn_shards, number):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    train(settings("footprints", epochs=2), learn_shards, whole)

    def interrupt(done, total):
        if done == 2:
            os.kill(os.getpid(), number)

    with pytest.raises(KeyboardInterrupt):
        train(settings("footprints", epochs=2, workers=2), learn_shards, cut, on_progress=interrupt)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert read_checkpoint(cut / "last.ckpt")[0].batches in (2, 3)
    train(settings("footprints", epochs=2), learn_shards, cut)
    assert same(weights(whole), weights(cut))


def test_a_finished_training_stays_and_can_be_prolonged(tmp_path, learn_shards):
    run, longer = tmp_path / "run", tmp_path / "longer"
    train(settings(epochs=1), learn_shards, run)
    before = weights(run)
    again = train(settings(epochs=1), learn_shards, run)
    assert (again.steps, again.resumed_step) == (4, 4)
    assert same(weights(run), before)
    train(settings(epochs=2), learn_shards, run)
    train(settings(epochs=2), learn_shards, longer)
    assert (run / "last.ckpt").read_bytes() == (longer / "last.ckpt").read_bytes()


@pytest.mark.slow
def test_the_loss_falls(tmp_path, learn_shards):
    chosen = settings("footprints", epochs=6, colour=0.0, flip=0.0, lr=1e-2)
    train(chosen, learn_shards, tmp_path / "run")
    with (tmp_path / "run" / "metrics.csv").open(newline="") as file:
        losses = [float(row["value"]) for row in csv.DictReader(file) if row["name"] == "val/loss"]
    assert len(losses) == 6
    assert losses[-1] < 0.7 * losses[0]


def test_a_loss_that_is_no_number_stops_and_names_the_frames(tmp_path, learn_shards):
    with pytest.raises(TrainingError, match=r"not finite at step \d+ \(.*batch of scene-0001 CAM_"):
        train(settings(lr=1e3, epochs=20), learn_shards, tmp_path / "run")


def test_other_settings_in_the_same_folder_are_refused(tmp_path, learn_shards):
    run = tmp_path / "run"
    train(settings(epochs=1, max_steps=1), learn_shards, run)
    with pytest.raises(OutputError, match=r"seed is 5 here but 0 there; use --overwrite"):
        train(settings(epochs=1, max_steps=1, seed=5), learn_shards, run)
    summary = train(settings(epochs=1, max_steps=1, seed=5), learn_shards, run, overwrite=True)
    assert summary.resumed_step == 0


def test_a_foreign_folder_is_left_alone(tmp_path, learn_shards):
    (tmp_path / "mine.txt").write_text("mine")
    for overwrite in (False, True):
        with pytest.raises(OutputError, match="no training made it"):
            train(settings(), learn_shards, tmp_path, overwrite=overwrite)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("more", "error", "message"),
    [
        ({"cameras": ("CAM_FRONT_LEFT",)}, SettingsError, "unknown camera"),
        ({"train_split": "test"}, TrainingError, "split 'test' has no scene"),
        ({"target": "dlt"}, (SettingsError, ShardError), "ogmkit homography-fit .* --method dlt"),
        ({"system": "footprints", "masks": "dlt"}, (SettingsError, ShardError), "render-footprints .*dlt"),
        ({"system": "oft", "bev_cell_m": 0.7}, SettingsError, "0.7"),
        ({"encoder": "resnet19"}, SettingsError, "resnet1"),
        ({"encoder_weights": "/nowhere/at/all.pth"}, Exception, "all.pth"),
    ],
)
def test_wrong_input_is_named_before_anything_is_written(tmp_path, learn_shards, more, error, message):
    system = more.pop("system", "homography")
    with pytest.raises(error, match=message):
        train(settings(system, **more), learn_shards, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_what_a_kill_left_of_a_training_that_had_just_begun_is_no_obstacle(tmp_path, learn_shards):
    run = tmp_path / "run"
    (run / "tensorboard").mkdir(parents=True)
    for name in (".config.yaml.77.part", ".last.ckpt.77.part", LOCK):
        (run / name).write_text("system: homo")
    assert train(settings(epochs=1, max_steps=1), learn_shards, run).steps == 1
    assert not [path.name for path in run.iterdir() if path.name.startswith(".")]


def test_equal_trainings_give_equal_bytes(tmp_path, learn_shards):
    for name in ("one", "other"):
        train(settings("footprints", epochs=1), learn_shards, tmp_path / name)
    for name in ("last.ckpt", "best.ckpt", "metrics.csv", "samples.png"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes(), name


def test_a_second_training_in_the_folder_is_refused(tmp_path, learn_shards):
    run, refused = tmp_path / "run", []

    def begin_another(done, total):
        for overwrite in (False, True):
            with pytest.raises(OutputError, match="another ogmkit command is writing here") as caught:
                train(settings(epochs=1, max_steps=1), learn_shards, run, overwrite=overwrite)
            refused.append(caught.value)

    train(settings(epochs=1, max_steps=1), learn_shards, run, on_progress=begin_another)
    assert len(refused) >= 2


@pytest.mark.parametrize("name", ["tensorboard", "metrics.csv", "samples.png", "best.ckpt"])
def test_what_can_t_be_written_is_named(tmp_path, learn_shards, name):
    run = tmp_path / "run"
    run.mkdir()
    if name == "tensorboard":
        (run / name).symlink_to("/proc")
    else:
        (run / name).mkdir()
    (run / "config.yaml").write_text(as_yaml(replace(settings(epochs=1), cameras=CAMERAS)))
    with pytest.raises((OutputError, CheckpointError), match=rf"{name}: can't be (written: |read \()"):
        train(settings(epochs=1), learn_shards, run)


@pytest.fixture(scope="module")
def begun(tmp_path_factory, learn_shards):
    """A training of one epoch; tests only read it."""
    run = tmp_path_factory.mktemp("begun") / "run"
    train(settings(epochs=1), learn_shards, run)
    return run


@pytest.fixture
def resume(begun, learn_shards, tmp_path):
    """Go on with a copy of the training in which a file was replaced."""

    def go_on(name, content):
        run = shutil.copytree(begun, tmp_path / "run")
        (run / name).unlink()
        (run / name).write_bytes(content)
        return train(settings(epochs=2, max_steps=5), learn_shards, run)

    return go_on


def test_a_last_checkpoint_that_is_no_training_s_own_is_refused(
    tmp_path, learn_shards, begun, resume, make_run
):
    foreign = make_run(tmp_path / "ved", "ved", GRID, CAMERAS) / "best.ckpt"
    other = tmp_path / "other"
    train(settings(epochs=1, max_steps=1, lr=0.1), learn_shards, other)
    for content, message in (
        ((begun / "best.ckpt").read_bytes(), "holds weights alone, as best.ckpt does; .*--overwrite"),
        (foreign.read_bytes(), "is of ved, not of homography"),
        ((other / "last.ckpt").read_bytes(), "is another training's: lr is 0.001 here but 0.1 there"),
    ):
        with pytest.raises(CheckpointError, match=rf"last\.ckpt: {message}"):
            resume("last.ckpt", content)
        shutil.rmtree(tmp_path / "run")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("splits.json", b'{"train": [1], "val": []}', "'train' is not a list of scene names"),
        ("splits.json", b"[" * 100_000, "not JSON"),
        ("splits.json", b'{"train": ["scene-0001"]}', "a training on other scenes exists"),
        ("config.yaml", b"[" * 100_000, "nested too deeply"),
        ("config.yaml", b"lr: " + b"9" * 400, "a training with other settings exists"),
        ("metrics.csv", b"epoch,step,name,value\n0,1,val/loss,many\n", "is damaged"),
        ("metrics.csv", b"epoch,step,name,value\n0,1\n", "is damaged"),
        ("metrics.csv", b"epoch,step,name,value\n0,\xff,a,1\n", "is damaged"),
        ("metrics.csv", b"\0" * 100 + b"\n", "is damaged"),
    ],
)
def test_odd_files_of_a_run_are_named(resume, name, content, message):
    with pytest.raises(OgmkitError, match=message):
        resume(name, content)


def test_a_figure_that_was_cut_short_is_dropped(resume, begun, tmp_path):
    whole = (begun / "metrics.csv").read_bytes()
    resume("metrics.csv", whole + b"1,2,val/lo")
    found = (tmp_path / "run" / "metrics.csv").read_bytes()
    assert found.startswith(whole)
    assert b"val/lo" not in found.replace(b"val/loss", b"")
