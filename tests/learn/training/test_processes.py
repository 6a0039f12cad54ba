"""Two processes that train together learn what one alone does, and resume exactly."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch

from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import read_checkpoint
from ogmkit.learn.figures import read_figures
from ogmkit.learn.training.train import train

SCRIPT = Path(__file__).parent / "together" / "one_of_several.py"
TINY = {
    "image_size": (64, 96),
    "encoder": "tu-test_resnet",
    "warp": "surface",
    "epochs": 3,
    "workers": 0,
    "batch_norm": "kept",
    "flip": 0.5,
}
COMPARED = {"lstm-ed": {}, "mid-to-end": {"optimizer": "adamw"}, "footprints": {"flip": 0.0}}
CLOSE = {"rtol": 1e-4, "atol": 1e-6}
"""Sums of float32 in another order: what was seen is a tenth of that."""


def values_of(system, **more):
    """Settings that the system reads, of a global batch of two samples, thus two steps an epoch."""
    return CATALOGUE[system].read({**TINY, "batch_size": 2, **COMPARED.get(system, {}), **more})


def together(shards, trainings, processes=2):
    """Run trainings in processes that this one starts; each is a system, its values and its run."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    shared = {
        **os.environ,
        "MASTER_ADDR": "127.0.0.1",
        "MASTER_PORT": str(port),
        "WORLD_SIZE": str(processes),
        "OMP_NUM_THREADS": "1",
    }
    command = [sys.executable, str(SCRIPT), str(shards), json.dumps(trainings, default=str)]
    started = [
        subprocess.Popen(command, env={**shared, "LOCAL_RANK": str(rank)}) for rank in range(processes)
    ]
    try:
        assert [process.wait(240) for process in started] == [0] * processes
    finally:
        for process in started:
            process.kill()


def weights(run):
    return read_checkpoint(run / "last.ckpt")[1]["state_dict"]


def figures(run):
    return {(one.step, one.name): one.value for one in read_figures(run / "metrics.csv")}


@pytest.fixture(scope="module")
def runs(tmp_path_factory, plan_shards):
    """Each system by one process, by two, and by two that were stopped at step 3 of 6 and resumed."""
    folder = tmp_path_factory.mktemp("runs")
    pair = {"devices": 2, "batch_size": 1}
    trainings = []
    for system in COMPARED:
        alone, whole = values_of(system, limit_frames=4), values_of(system, limit_frames=4, **pair)
        train(CATALOGUE[system].settings(**alone), plan_shards, folder / f"{system}-alone")
        trainings += [
            (system, whole, folder / f"{system}-whole"),
            (system, {**whole, "max_steps": 3}, folder / f"{system}-cut"),
            (system, whole, folder / f"{system}-cut"),
        ]
    together(plan_shards, trainings)
    return folder


@pytest.mark.parametrize("system", COMPARED)
def test_two_processes_find_what_one_does(runs, system):
    alone, whole = (weights(runs / f"{system}-{how}") for how in ("alone", "whole"))
    assert alone.keys() == whole.keys()
    for name, value in alone.items():
        torch.testing.assert_close(whole[name], value, msg=name, **CLOSE)
    alone, whole = (figures(runs / f"{system}-{how}") for how in ("alone", "whole"))
    assert {step for step, name in alone if name == "val/loss"} == {2, 4, 6}
    assert whole == pytest.approx(alone, rel=CLOSE["rtol"])


@pytest.mark.parametrize("system", COMPARED)
def test_stopped_within_an_epoch_and_resumed_the_weights_are_the_same(runs, system):
    whole, cut = (weights(runs / f"{system}-{how}") for how in ("whole", "cut"))
    assert whole.keys() == cut.keys()
    assert all(torch.equal(value, cut[name]) for name, value in whole.items())
    whole, cut = (figures(runs / f"{system}-{how}") for how in ("whole", "cut"))
    assert whole.items() <= cut.items()  # the stop itself was an end, with a validation
