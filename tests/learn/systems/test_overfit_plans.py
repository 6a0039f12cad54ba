"""Each planner can learn four sequences by heart, to 0.1 m at 2.5 s."""

import pytest
import torch

from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.systems.registry import build_system
from ogmkit.samples.index import index_sequences
from ogmkit.shards.manifest import read_manifest

pytestmark = pytest.mark.slow

CAMERAS = ("CAM_FRONT",)
COMMON = {"image_size": (64, 96), "encoder": "resnet18", "masks": "surface", "warp": "surface"}


@pytest.fixture(scope="module")
def shards(tmp_path_factory, make_plan_shards):
    """One sequence a scene, so that no two are alike."""
    return make_plan_shards(tmp_path_factory.mktemp("many"), 5, 13)


def batches_of(shards, spec):
    scenes = [entry.scene for entry in read_manifest(shards).shards]
    index = index_sequences(shards, scenes, CAMERAS, needs=spec, limit=4)
    return loader(SequenceDataset(index, spec), EpochBatches(4, 4, seed=0, shuffle=False), workers=0)


@pytest.mark.parametrize(
    ("system", "steps", "no_past"),
    [
        ("lstm-ed", 1000, False),
        ("mid-to-end", 1000, False),
        ("mid-to-end", 1000, True),
        ("end-to-end", 700, False),
        ("end-to-end", 700, True),
        ("holistic", 700, False),
        ("holistic", 700, True),
        ("holistic-cv", 700, False),
    ],
)
def test_four_sequences_are_learnt_by_heart(shards, system, steps, no_past):
    torch.manual_seed(0)
    grid = read_manifest(shards).settings.targets.grid
    entry = CATALOGUE[system]
    settings = entry.settings(**entry.read({**COMMON, "no_past": no_past}))
    net = build_system(settings, grid, CAMERAS)
    net.prepare(batches_of(shards, net.prepare_spec))
    (batch,) = batches_of(shards, net.spec)
    last = batch["future"][:, 4]
    assert float(torch.pdist(last).max()) > 2, last  # no one answer serves them all

    # Features that move as fast as the planner does would be a moving target.
    eyes = [weight for name, weight in net.named_parameters() if not name.startswith("planner.")]
    groups = [{"params": net.planner.parameters(), "lr": 3e-3}, {"params": eyes, "lr": 1e-4}]
    optimizer = torch.optim.AdamW(groups, weight_decay=0.0)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps)
    net.train()
    for _ in range(steps):
        optimizer.zero_grad()
        sum(net.losses(net.answer(batch), batch).values()).backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 10.0)
        optimizer.step()
        schedule.step()

    net.eval()
    with torch.inference_mode():
        error_m = (net.predict(batch).plan.mean - batch["future"][:, :5]).norm(dim=-1)
    assert float(error_m[:, 4].max()) < 0.1, error_m
