"""Several devices validate each sample once, however their rounds end."""

from types import SimpleNamespace

import pytest
import torch

from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.data.module import Loading, ShardDataModule
from ogmkit.learn.systems.registry import build_system
from ogmkit.shards.manifest import read_manifest

CAMERAS = ("CAM_FRONT",)


@pytest.fixture
def validated(plan_shards):
    """`validated(rank, world)`: what one device makes of the validation, in so many steps.

    The sums of losses and of the score, each with its weight.
    """

    def validate(rank, world):
        torch.manual_seed(0)
        grid = read_manifest(plan_shards).settings.targets.grid
        net = build_system(CATALOGUE["lstm-ed"].settings(), grid, CAMERAS)
        scenes = ["scene-0001"], ["scene-0002"]
        data = ShardDataModule(plan_shards, *scenes, CAMERAS, net.spec, loading=Loading(1), sequences=True)
        trainer = SimpleNamespace(global_rank=rank, world_size=world, datamodule=data)
        data.trainer = net._trainer = trainer
        logged = []
        net.log_dict = lambda values, batch_size, **how: logged.append((values["val/loss"], batch_size))
        with torch.no_grad():
            for number, batch in enumerate(data.val_dataloader()):
                net.validation_step(batch, number)
        del trainer.datamodule  # the two hold each other, and the shards open
        loss = sum(float(value) * count for value, count in logged)
        weight = sum(count for _, count in logged)
        return torch.tensor([loss, weight, float(net.ade.mean_value), float(net.ade.weight)]), len(logged)

    return validate


@pytest.mark.parametrize("world", [2, 3, 5])
def test_devices_score_what_one_alone_does(validated, world):
    alone, _ = validated(0, 1)
    found, steps = zip(*(validated(rank, world) for rank in range(world)), strict=True)
    together = torch.stack(found).sum(dim=0)

    assert len(set(steps)) == 1  # they wait for each other
    assert (alone[1], together[1]) == (4, 4 * world)
    torch.testing.assert_close(together / torch.tensor([world, world, 1, 1]), alone)
