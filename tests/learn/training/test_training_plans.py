"""Planners are trained as all systems are: exactly resumed, and told in one line what is wrong."""

import shutil

import h5py
import numpy as np
import pytest
import torch

from ogmkit.errors import SettingsError, ShardError, TrainingError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import read_checkpoint
from ogmkit.learn.training.train import train

TINY = {"image_size": (64, 96), "encoder": "tu-test_resnet", "warp": "surface", "batch_size": 2, "epochs": 2}


def settings_of(system, **values):
    """Settings of a system, among values for several."""
    entry = CATALOGUE[system]
    return entry.settings(**entry.read({"workers": 0, **TINY, **values}))


class Crash(Exception):  # noqa: N818  # stands for a kill
    """Stands for a process that dies between two steps."""


def weights(run):
    return read_checkpoint(run / "last.ckpt")[1]["state_dict"]


@pytest.mark.parametrize(
    ("system", "more"),
    [
        ("lstm-ed", {"epochs": 3, "optimizer": "adamw", "schedule": "cosine"}),
        ("mid-to-end", {"flip": 0.5, "no_past": True}),
        pytest.param(
            "holistic", {"flip": 0.5, "colour": 0.2, "checkpoint_gradients": True}, marks=pytest.mark.slow
        ),
    ],
)
def test_killed_and_resumed_the_weights_are_the_same(tmp_path, plan_shards, system, more):
    chosen = settings_of(system, **({"checkpoint_every": 1} | more))
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    summary = train(chosen, plan_shards, whole)
    assert (summary.frames, summary.val_frames, summary.steps) == (4, 4, 2 * chosen.epochs)
    assert {path.name for path in whole.iterdir()} >= {"best.ckpt", "samples.png", "metrics.csv"}

    def crash(done, total):
        if done == 3:
            raise Crash

    with pytest.raises(Crash):
        train(chosen, plan_shards, cut, on_progress=crash)
    assert 0 < train(chosen, plan_shards, cut).resumed_step <= 3 < summary.steps
    there, here = weights(whole), weights(cut)
    assert there.keys() == here.keys()
    assert all(torch.equal(value, here[name]) for name, value in there.items())


def test_gradients_worked_out_twice_teach_the_same(tmp_path, plan_shards):
    for lean in (False, True):
        chosen = settings_of("end-to-end", checkpoint_gradients=lean, encoder="resnet18", epochs=1)
        train(chosen, plan_shards, tmp_path / str(lean))
    there, here = weights(tmp_path / "False"), weights(tmp_path / "True")
    for name, value in there.items():
        torch.testing.assert_close(value, here[name], msg=name)


@pytest.mark.parametrize(
    ("more", "error", "message"),
    [
        ({"system": "holistic", "warp": "network"}, ShardError, "`ogmkit predict homography"),
        ({"system": "holistic-cv", "masks": "network"}, ShardError, "`ogmkit render-footprints"),
        (
            {"system": "end-to-end", "encoder": "vgg11_bn", "checkpoint_gradients": True},
            SettingsError,
            "resnet101",
        ),
        ({"system": "lstm-ed", "cameras": ("CAM_BACK",)}, SettingsError, "unknown camera"),
    ],
    ids=["homography", "masks", "encoder", "camera"],
)
def test_wrong_input_is_named_before_anything_is_written(tmp_path, plan_shards, more, error, message):
    with pytest.raises(error, match=message):
        train(settings_of(**more), plan_shards, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_scenes_without_six_frames_in_a_row_or_a_trajectory_are_named(tmp_path, learn_shards):
    message = "none of 16 frames can be used .*5 images before it.*0 have a valid trajectory"
    with pytest.raises(TrainingError, match=message):
        train(settings_of("lstm-ed"), learn_shards, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_poses_that_are_no_numbers_stop_the_training(tmp_path, plan_shards):
    shards = tmp_path / "shards"
    shutil.copytree(plan_shards, shards)
    with h5py.File(shards / "scene-0001.h5", "r+") as h5:
        h5["CAM_FRONT/global_from_ego"][7, 0, 3] = np.nan
    with pytest.raises(ShardError, match=r"scene-0001.*CAM_FRONT frame 7: .*not finite"):
        train(settings_of("lstm-ed"), shards, tmp_path / "run")
