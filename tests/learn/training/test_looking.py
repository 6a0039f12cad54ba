"""Planners behind a frozen perception look at each image once, and learn what looking always would teach."""

import os
import shutil
import signal
from types import SimpleNamespace

import cv2
import pytest
import torch

from ogmkit.base.news import Found, Passed, Waiting, listening
from ogmkit.errors import OutputError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import read_checkpoint
from ogmkit.learn.models.footprint_net import FootprintNet
from ogmkit.learn.systems.holistic import SeeingSystem
from ogmkit.learn.training.train import train
from ogmkit.shards.manifest import read_manifest

TINY = {"image_size": (64, 96), "encoder": "tu-test_resnet", "masks": "surface", "warp": "surface"}
EPOCHS, BATCH = 3, 2
FRAMES = 9
"""Of a scene, those in one of its four sequences; one scene is learnt from, the other validates."""


@pytest.fixture
def settings_of(plan_shards, tmp_path, make_run):
    """Settings of a planner whose perception is frozen."""
    grid = read_manifest(plan_shards).settings.targets.grid
    stage_1 = make_run(tmp_path / "footprints", "footprints", grid, ("CAM_FRONT",))
    frozen = {"perception": str(stage_1), "freeze": ("perception",), "flip": 0.5}
    common = {"workers": 0, "epochs": EPOCHS, "batch_size": BATCH, "lr": 0.05, **TINY, **frozen}

    def make(system, **more):
        entry = CATALOGUE[system]
        return entry.settings(**entry.read(common | more))

    return make


@pytest.fixture
def looked(monkeypatch):
    """Numbers of images that a perception looked at, call by call."""
    numbers, forward = [], FootprintNet.forward

    def counted(self, image):
        numbers.append(len(image))
        return forward(self, image)

    monkeypatch.setattr(FootprintNet, "forward", counted)
    return numbers


def weights(run):
    return read_checkpoint(run / "last.ckpt")[1]["state_dict"]


def left(run):
    """Files that were not finished."""
    return [path for path in run.iterdir() if path.name.endswith(".part")]


@pytest.mark.parametrize("system", ["holistic", "holistic-cv"])
def test_the_same_is_learnt_by_looking_once(settings_of, plan_shards, tmp_path, looked, monkeypatch, system):
    once, always = tmp_path / "once", tmp_path / "always"
    train(settings_of(system, cache_samples=True), plan_shards, once)
    pictures = BATCH * EPOCHS
    assert sum(looked) == 2 * FRAMES + FRAMES + pictures  # mirror images of those for training
    looked.clear()
    monkeypatch.setattr(SeeingSystem, "sees_alike", False)
    train(settings_of(system), plan_shards, always)
    sanity, each = 6 * BATCH, 6 * (4 + 4)
    assert sum(looked) == sanity + EPOCHS * each + (6 + 1) * pictures
    there, here = weights(always), weights(once)
    assert there.keys() == here.keys()
    for name, value in there.items():
        torch.testing.assert_close(here[name], value, rtol=1e-4, atol=1e-5, msg=name)
    sheets = [cv2.imread(str(run / "samples.png")) for run in (once, always)]
    assert sheets[0].shape == sheets[1].shape
    assert not left(once)


def test_images_that_change_are_looked_at_anew_and_that_is_told(settings_of, plan_shards, tmp_path, looked):
    found = []
    with listening(found.append):
        train(settings_of("holistic-cv", colour=0.1, epochs=1), plan_shards, tmp_path / "run")
    assert [one.text for one in found if isinstance(one, Found) and "without --colour" in one.text]
    assert sum(looked) == 6 * BATCH + 6 * (4 + 4) + (6 + 1) * BATCH


def test_ctrl_c_stops_the_looking_and_the_same_training_then_begins(settings_of, plan_shards, tmp_path):
    chosen, run = settings_of("holistic-cv", epochs=1, batch_size=1), tmp_path / "run"

    def stop(news):
        if isinstance(news, Waiting) and news.text.startswith("looking once"):
            os.kill(os.getpid(), signal.SIGINT)

    with listening(stop), pytest.raises(KeyboardInterrupt):
        train(chosen, plan_shards, run)
    assert not left(run)
    assert not (run / "last.ckpt").exists()
    told = []
    with listening(told.append):
        assert train(chosen, plan_shards, run).steps == 4
    passed = [one.text for one in told if isinstance(one, Passed)]
    assert [text.partition(", in")[0] for text in passed[:2]] == [
        "looked once at 18 training images",
        "looked once at 9 validation images",
    ]


def test_room_is_asked_for_first(settings_of, plan_shards, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(OutputError, match=r"looking at each image once needs .* lower --pool-cells"):
        train(settings_of("holistic"), plan_shards, tmp_path / "run")
    assert not left(tmp_path / "run")
