import platform
import shutil
import subprocess
import sys

import h5py
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.errors import DataFileError, SettingsError
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import SampleSpec


def batches_of(count=23, batch_size=4, **options):
    options = {"seed": 3, "shuffle": True} | options
    return EpochBatches(count, batch_size, **options)


def epoch_of(batches, epoch, skip=0):
    batches.epoch, batches.skip = epoch, skip
    return list(batches)


def places(epoch):
    return [place for batch in epoch for place, _ in batch]


def seeds(epoch):
    return {place: seed for batch in epoch for place, seed in batch}


def test_every_sample_once():
    epoch = epoch_of(batches_of(), 0)

    assert [len(batch) for batch in epoch] == [4, 4, 4, 4, 4, 3]
    assert sorted(places(epoch)) == list(range(23))
    assert places(epoch) != list(range(23))
    assert len({seed for batch in epoch for _, seed in batch}) == 23


def test_in_order_where_not_shuffled():
    assert places(epoch_of(batches_of(shuffle=False), 4)) == list(range(23))


def test_epochs_differ_and_come_again():
    batches = batches_of()
    first, second = epoch_of(batches, 0), epoch_of(batches, 1)

    assert first != second
    assert seeds(first) != seeds(second)
    assert epoch_of(batches_of(), 1) == second
    assert epoch_of(batches_of(seed=4), 1) != second


def test_augmentation_depends_on_the_place_not_on_the_batch():
    one, other = (epoch_of(batches_of(**options), 2) for options in ({}, {"batch_size": 7, "shuffle": False}))

    assert seeds(one) == seeds(other)


@pytest.mark.parametrize("skip", [0, 1, 5, 6])
def test_an_epoch_goes_on_after_those_that_are_skipped(skip):
    batches = batches_of()
    whole = epoch_of(batches, 2)

    rest = epoch_of(batches, 2, skip)

    assert rest == whole[skip:]
    assert len(batches) == 6


def test_without_the_last():
    batches = batches_of(drop_last=True)

    assert [len(batch) for batch in epoch_of(batches, 0)] == [4] * 5
    assert len(batches) == 5


@given(st.integers(1, 40), st.integers(1, 5), st.integers(1, 4), st.booleans())
def test_devices_take_turns(count, batch_size, world, drop_last):
    alone = epoch_of(batches_of(count, batch_size, drop_last=drop_last), 1)
    ranks = [
        batches_of(count, batch_size, drop_last=drop_last, rank=rank, world=world) for rank in range(world)
    ]
    shares = [epoch_of(batches, 1) for batches in ranks]

    assert {len(share) for share in shares} == {len(ranks[0])}
    in_turn = [batch for round_ in zip(*shares, strict=True) for batch in round_]
    if drop_last:
        assert in_turn == alone[: len(alone) // world * world]
    else:
        assert in_turn[: len(alone)] == alone
        assert len(in_turn) - len(alone) < world


def test_a_batch_has_a_size():
    with pytest.raises(SettingsError, match="batch size: 0 is not positive"):
        batches_of(batch_size=0)


@pytest.mark.parametrize("workers", [0, 2])
def test_workers_follow_epochs_and_pass_errors_on_in_one_line(copied_shards, workers):
    needs = SampleSpec((30, 64))
    index = index_frames(copied_shards, ["scene-0001"], ["CAM_FRONT"], needs=needs)
    dataset = FrameDataset(index, needs, augment=Augmentation())
    batches = batches_of(len(dataset))
    loading = loader(dataset, batches, workers=workers)

    for epoch in range(2):
        keys = epoch_of(batches, epoch)
        for batch, expected in zip(loading, keys, strict=True):
            assert batch["index"].tolist() == [place for place, _ in expected]
            assert torch.equal(batch["image"], torch.stack([dataset[key]["image"] for key in expected]))

    damage(copied_shards / "scene-0001.h5", frame=keys[1][2][0])
    with pytest.raises(DataFileError) as caught:
        list(loader(FrameDataset(index, needs), batches, workers=workers))
    place = f"{copied_shards}/scene-0001.h5: CAM_FRONT frame {keys[1][2][0]}"
    assert str(caught.value).startswith(f"{place}: image is not a whole JPEG or PNG (cut short); ")
    assert "\n" not in str(caught.value)


def damage(path, frame):
    """Cut a stored JPEG short, in a new file in the old one's place: it may be open."""
    changed = path.with_suffix(".part")
    shutil.copy(path, changed)
    with h5py.File(changed, "r+") as h5:
        h5["CAM_FRONT/image"][frame] = h5["CAM_FRONT/image"][frame][:-300]
    changed.replace(path)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="settings of GNU's C library")
@pytest.mark.slow
def test_freed_memory_serves_the_next_sample():
    """In a process of its own, for the setting stays: a second array comes without a fault for each page."""
    script = (
        "import resource\n"
        "from ogmkit.learn.data.loader import keep_freed_memory\n"
        "keep_freed_memory()\n"
        "def faults():\n"
        "    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
        "    bytes(bytearray(8 << 20))\n"
        "    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before\n"
        "faults()\n"
        "assert faults() < 400, 'of 4096 pages'\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)
