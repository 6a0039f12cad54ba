"""Small samples come from memory once they were read, and are the same."""

import pickle

import pytest
import torch

from ogmkit.errors import SettingsError, ShardError
from ogmkit.learn.data import reader
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.reading import read_part_counts, read_sample
from ogmkit.samples.spec import SampleSpec

SCENES = ("scene-0001", "scene-0002")
PARTS = (40, 30)
"""Of 2 × 2 cells; the ego, at column 34, is on an edge."""
SMALL = SampleSpec(trajectory=True, bev_parts=PARTS)
FLIP = Augmentation(colour=0, flip=0.5)


@pytest.fixture
def make(plan_shards):
    """`make(spec, **options)`: all sequences of two scenes."""

    def sequences(spec, **options):
        return SequenceDataset(index_sequences(plan_shards, SCENES, (), needs=spec), spec, **options)

    return sequences


@pytest.fixture
def reads(monkeypatch):
    """The names of what is read, as it is read."""
    found = []

    def counted(read):
        def reading(*arguments):
            found.append(read.__name__)
            return read(*arguments)

        return reading

    for read in (read_sample, read_part_counts):
        monkeypatch.setattr(reader, read.__name__, counted(read))
    return found


def equal(one, other):
    assert set(one) == set(other)
    for name, value in one.items():
        torch.testing.assert_close(value, other[name], rtol=0, atol=0, equal_nan=True, msg=name)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_averages_are_those_of_the_masks_flipped_or_not(make, seed):
    whole = make(SampleSpec(bev_cell_m=0.5, bev=True, trajectory=True), augment=FLIP)[(5, seed)]
    sample = make(SMALL, augment=FLIP)[(5, seed)]

    masks = whole["bev"].reshape(6, 2, 40, 2, 30, 2)
    torch.testing.assert_close(sample["bev_parts"], masks.mean((3, 5)), rtol=0, atol=0)
    assert 0 < float(sample["bev_parts"].mean()) < 1
    for name in ("positions", "past", "future"):
        assert torch.equal(sample[name], whole[name])


def test_beside_images_they_are_the_same(make, plan_shards):
    beside = make(SampleSpec((30, 64), trajectory=True, bev_parts=PARTS))[3]
    assert torch.equal(beside["bev_parts"], make(SMALL)[3]["bev_parts"])
    index = index_frames(plan_shards, SCENES, (), needs=SMALL)
    last = FrameDataset(index, SMALL)[0]
    assert torch.equal(last["bev_parts"], make(SMALL)[0]["bev_parts"][-1])


@pytest.mark.parametrize(
    ("spec", "frames"), [(SampleSpec(trajectory=True), 0), (SMALL, 2 * 9)], ids=["paths", "averages"]
)
def test_each_path_and_frame_is_read_once(make, reads, spec, frames):
    dataset = make(spec, augment=FLIP)
    keys = [(i, seed) for i in range(len(dataset)) for seed in (1, 2, 3)]
    first = [dataset[key] for key in keys]
    assert reads.count("read_sample") == len(dataset) == 8
    assert reads.count("read_part_counts") == frames  # four sequences of six frames share nine

    reads.clear()
    for key, sample in zip(keys, first, strict=True):
        equal(dataset[key], sample)
    equal(dataset[5], make(spec)[5])
    assert reads == ["read_sample", *["read_part_counts"] * (6 * bool(frames))]  # by the other data set


def test_samples_with_images_are_read_each_time(make, reads):
    dataset = make(SampleSpec((30, 64), trajectory=True))
    equal(dataset[2], dataset[2])
    assert reads == ["read_sample"] * 2


def test_what_has_no_room_is_read_again(make, reads, monkeypatch):
    dataset = make(SMALL)
    monkeypatch.setattr(reader, "MOST_KEPT_BYTES", 2200 + 3 * 2 * 40 * 30)
    first = dataset[0]  # its path and three of its six frames stay
    reads.clear()
    equal(dataset[0], first)
    assert reads == ["read_part_counts"] * 3


def test_a_sample_can_be_changed_without_harm(make):
    dataset = make(SMALL)
    first = {name: value.clone() for name, value in dataset[1].items()}
    for value in dataset[1].values():
        value.zero_()
    equal(dataset[1], first)


def test_workers_get_no_copies(make):
    dataset = make(SMALL)
    before = len(pickle.dumps(dataset))
    first = dataset[0]
    assert len(pickle.dumps(dataset)) == before
    equal(pickle.loads(pickle.dumps(dataset))[0], first)


@pytest.mark.parametrize("parts", [(40, 29), (16, 20)], ids=["rest", "ego inside a part"])
def test_parts_that_do_not_divide_the_grid_are_refused(make, parts):
    with pytest.raises(SettingsError, match=f"sample: {parts[0]} × {parts[1]} parts don't divide the grid"):
        make(SampleSpec(bev_parts=parts))


def test_a_damaged_frame_is_named(make, monkeypatch):
    def broken(masks, parts):
        raise OSError("bad chunk")

    monkeypatch.setattr("ogmkit.samples.reading.part_counts", broken)
    with pytest.raises(ShardError, match=r"scene-0001\.h5"):
        make(SMALL)[0]
