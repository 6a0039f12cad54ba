"""Two processes that train together learn what one alone does, and resume exactly."""

import json
import os
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
import torch
from torch import distributed

from ogmkit.base.news import Passed, listening
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import read_checkpoint
from ogmkit.learn.figures import read_figures
from ogmkit.learn.training.processes import LostProcessError
from ogmkit.learn.training.train import train
from ogmkit.shards.manifest import read_manifest

SECOND = Path(__file__).parent / "together" / "second.py"
TINY = {"image_size": (64, 96), "encoder": "tu-test_resnet", "target": "surface", "batch_norm": "kept"}
SYSTEMS = {
    "lstm-ed": {},
    "mid-to-end": {"optimizer": "adamw"},
    "homography": {"head": "four-point"},
    "holistic-cv": {"freeze": ("perception",)},
}
"""Two see images, one each of them once. None drops features at random: processes would draw their own."""
RELATIVE = 1e-5
"""Tolerance of losses, scores and weights: sums of float32 come in another order."""
ABSOLUTE = 1e-6
"""Of weights that begin at zero."""
TOGETHER = "whole", "cut", "cut"


def settings_of(system, **more):
    """Two steps an epoch, of two samples: by two processes one each, or by one alone."""
    both = {"devices": 2, "batch_size": 1}
    common = {**TINY, **SYSTEMS[system], "limit_frames": 4, "epochs": 2, "workers": 0, "flip": 0.5, "seed": 7}
    return CATALOGUE[system].read({**common, **both, **more})


@contextmanager
def together(shards, trainings):
    """Inside, this process is the first of two; the second one does the trainings: (system, values, run)."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    place = {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port), "WORLD_SIZE": "2", "LOCAL_RANK": "0"}
    command = [sys.executable, str(SECOND), str(shards), json.dumps(trainings, default=str)]
    own = {**os.environ, **place, "LOCAL_RANK": "1", "OMP_NUM_THREADS": "1"}
    with pytest.MonkeyPatch.context() as patch, subprocess.Popen(command, env=own, stdout=-1) as second:
        for name, value in place.items():
            patch.setenv(name, value)
        try:
            assert second.stdout.readline() == b"ready\n"  # else the first one would wait for it in vain
            yield second
        finally:
            second.kill()
            if distributed.is_initialized():
                distributed.destroy_process_group()


def stop_after_an_epoch(news):
    """Ctrl-C for this process alone, when the first epoch is over."""
    if isinstance(news, Passed) and news.text.startswith("epoch 1/"):
        os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture(scope="module")
def runs(tmp_path_factory, plan_shards, make_run):
    """Each system trained by one process, by two, and by two that were stopped at step 3 of 4 and resumed.

    At the end, one of two processes is killed.
    """
    folder = tmp_path_factory.mktemp("runs")
    grid = read_manifest(plan_shards).settings.targets.grid
    stage_1 = make_run(folder / "footprints", "footprints", grid, ("CAM_FRONT",))

    def values(system, **more):
        return settings_of(system, perception=str(stage_1), **more)

    def one(system, how, more=None, **options):
        chosen = CATALOGUE[system].settings(**values(system, **(more or {})))
        return train(chosen, plan_shards, folder / system / how, **options)

    work = [(system, values(system), folder / system / how) for system in SYSTEMS for how in TOGETHER]
    endless = {"epochs": 100_000}
    work.append(("lstm-ed", values("lstm-ed", **endless), folder / "lstm-ed" / "lost"))
    for system in SYSTEMS:
        one(system, "alone", {"devices": None, "batch_size": 2})
    with together(plan_shards, work) as second:
        for system in SYSTEMS:
            one(system, "whole")
            with listening(stop_after_an_epoch), pytest.raises(KeyboardInterrupt):
                one(system, "cut")
            assert one(system, "cut").resumed_step == 3
        with pytest.raises(LostProcessError, match="run the same command to resume"):
            one("lstm-ed", "lost", endless, on_progress=lambda done, _: done == 3 and second.kill())
    return folder


def weights(run):
    return read_checkpoint(run / "last.ckpt")[1]["state_dict"]


def figures(run):
    return {(one.step, one.name): one.value for one in read_figures(run / "metrics.csv")}


@pytest.mark.parametrize("system", SYSTEMS)
def test_two_processes_find_what_one_alone_does(runs, system):
    alone, both = weights(runs / system / "alone"), weights(runs / system / "whole")
    assert alone.keys() == both.keys()
    for name, value in alone.items():
        torch.testing.assert_close(both[name], value, rtol=RELATIVE, atol=ABSOLUTE, msg=name)
    alone, both = figures(runs / system / "alone"), figures(runs / system / "whole")
    assert [step for step, name in alone if name == "val/loss"] == [2, 4]
    assert both == pytest.approx(alone, rel=RELATIVE)


@pytest.mark.parametrize("system", SYSTEMS)
def test_stopped_within_an_epoch_and_resumed_the_bytes_are_the_same(runs, system):
    for name in ("last.ckpt", "best.ckpt", "metrics.csv"):
        whole, cut = (runs / system / how / name for how in ("whole", "cut"))
        assert whole.read_bytes() == cut.read_bytes()
