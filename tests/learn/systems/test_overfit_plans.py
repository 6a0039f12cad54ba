"""Each planner can learn four sequences by heart, to 0.1 m at 2.5 s."""

import json

import pytest
import torch

from ogmkit.learn.checkpoints import load_system
from ogmkit.learn.data.index import index_sequences
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.training import train

pytestmark = pytest.mark.slow

COMMON = {
    "image_size": (64, 96),
    "encoder": "resnet18",
    "warp": "surface",
    "batch_size": 4,
    "limit_frames": 4,
    "optimizer": "adamw",
    "lr": 2e-3,
    "schedule": "cosine",
    "checkpoint_every": 10_000,
}


@pytest.fixture(scope="module")
def shards(tmp_path_factory, make_plan_shards):
    """One sequence a scene, so that no two are alike."""
    return make_plan_shards(tmp_path_factory.mktemp("many"), 5, 13)


@pytest.mark.parametrize(
    ("system", "epochs", "no_past"),
    [
        ("lstm-ed", 800, False),
        ("mid-to-end", 800, False),
        ("mid-to-end", 800, True),
        ("end-to-end", 600, False),
        ("end-to-end", 600, True),
        ("holistic", 600, False),
        ("holistic", 600, True),
        ("holistic-cv", 600, False),
    ],
)
def test_four_sequences_are_learnt_by_heart(tmp_path, shards, system, epochs, no_past):
    run = tmp_path / "run"
    train(TrainSettings(system, **COMMON, epochs=epochs, no_past=no_past), shards, run)
    _, net = load_system(run / "last.ckpt")
    scenes = json.loads((run / "splits.json").read_text())["train"]
    index = index_sequences(shards, scenes, ("CAM_FRONT",), needs=net.spec, limit=4)
    samples = SequenceDataset(index, net.spec)
    (batch,) = loader(samples, EpochBatches(4, 4, seed=0, shuffle=False), workers=0)
    last = batch["future"][:, 4]
    assert float(torch.pdist(last).max()) > 2, last  # no one answer serves them all
    with torch.inference_mode():
        error_m = (net.predict(batch).plan.mean - batch["future"][:, :5]).norm(dim=-1)
    assert float(error_m[:, 4].max()) < 0.1, error_m
