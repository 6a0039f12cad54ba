from types import SimpleNamespace

import h5py
import numpy as np
import pytest
import torch

from ogmkit.errors import TrainingError
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.module import Loading, ShardDataModule
from ogmkit.samples.spec import SampleSpec

SPEC = SampleSpec((30, 64), "dlt", bev_cell_m=1.0, bev=True)


@pytest.fixture
def make(sample_shards):
    def module(**options):
        limit_frames = options.pop("limit_frames", None)
        loading = Loading(**{"batch_size": 3, "seed": 5, "augmentation": Augmentation()} | options)
        scenes = ["scene-0001"], ["scene-0002"]
        return ShardDataModule(sample_shards, *scenes, [], SPEC, loading=loading, limit_frames=limit_frames)

    return module


def test_training_and_validation_are_of_their_scenes_and_valid(make, sample_shards):
    module = make()

    for dataset, scene in ((module.train_set, "scene-0001"), (module.val_set, "scene-0002")):
        assert {dataset.place(i)[0] for i in range(len(dataset))} == {scene}
        with h5py.File(sample_shards / f"{scene}.h5") as h5:
            valid = [h5[f"{camera}/footprints/dlt/valid"][:] for camera in dataset.cameras]
        assert len(dataset) == np.sum(valid) < 16


def test_training_goes_on_in_mid_epoch(make):
    module, resumed = make(), make()
    module.train_batches.epoch = 3
    whole = list(module.train_dataloader())

    resumed.train_batches.epoch, resumed.train_batches.skip = 3, 1
    rest = list(resumed.train_dataloader())

    assert len(rest) == len(whole) - 1 > 0
    for ours, theirs in zip(rest, whole[1:], strict=True):
        assert all(torch.equal(ours[name], theirs[name]) for name in theirs)


def test_only_training_is_augmented_and_shuffled(make):
    module = make(augmentation=Augmentation(flip=1.0))
    validation = list(module.val_dataloader())

    index = torch.cat([batch["index"] for batch in validation])
    assert index.tolist() == list(range(len(module.val_set)))
    assert all((batch["bev_known"] == 1).all() for batch in validation)
    assert torch.equal(validation[0]["image"][0], module.val_set[0]["image"])
    assert all((batch["bev_known"] == 0).any() for batch in module.train_dataloader())


def test_devices_of_a_trainer_divide_the_batches(make):
    shares = []
    for rank in range(2):
        module = make(batch_size=1)
        module.trainer = SimpleNamespace(global_rank=rank, world_size=2)
        shares.append([int(batch["index"]) for batch in module.val_dataloader()])

    assert shares[0][0] == 0
    assert shares[1][0] == 1
    assert set(shares[0] + shares[1]) == set(range(len(module.val_set)))


def test_a_limit_holds_for_either_set(make):
    module = make(limit_frames=2)

    assert (len(module.train_set), len(module.val_set)) == (2, 2)


def test_an_empty_split_is_refused(sample_shards):
    with pytest.raises(TrainingError, match="there are 0 frames in the chosen scenes"):
        ShardDataModule(sample_shards, ["scene-0001"], [], [], SPEC, loading=Loading())
