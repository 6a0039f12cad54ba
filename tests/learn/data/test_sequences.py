import h5py
import numpy as np
import pytest
import torch

from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.spec import SampleSpec

SCENES = ("scene-0001", "scene-0002")
ALL = SampleSpec((30, 64), "calibration", "calibration", 1.0, True, True, True, True)
OF_THE_LAST = {"mirrored", "past", "future", "trajectory_valid", "camera", "index"}


@pytest.fixture
def folder(copied_shards):
    """Shards whose trajectories are called valid, though the scenes are too short for whole ones."""
    for path in copied_shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            for camera in h5.values():
                camera["trajectory/valid"][...] = True
    return copied_shards


@pytest.fixture
def make(folder):
    def dataset(**options):
        return SequenceDataset(index_sequences(folder, SCENES, [], needs=ALL), ALL, **options)

    return dataset


def test_a_sequence_is_six_frames_and_the_last_one_s_trajectory(make, folder):
    sequences = make()
    frames = FrameDataset(index_frames(folder, SCENES, [], needs=ALL), ALL)
    place = sequences.place(4)
    assert place == ("scene-0001", "CAM_FRONT", 6)

    sample = sequences[4]

    single = [frames[8 + t] for t in range(1, 7)]
    for name in single[0].keys() - OF_THE_LAST:
        torch.testing.assert_close(
            sample[name], torch.stack([frame[name] for frame in single]), rtol=0, atol=0, equal_nan=True
        )
    for name in OF_THE_LAST - {"index"}:
        torch.testing.assert_close(sample[name], single[-1][name], rtol=0, atol=0, equal_nan=True)
    assert int(sample["index"]) == 4


def test_a_sequence_without_a_whole_trajectory_says_so(sample_shards):
    spec = SampleSpec((30, 64), trajectory=True)
    index = index_sequences(sample_shards, SCENES, ["CAM_FRONT"], needs=spec, whole_trajectory=False)
    sequences = SequenceDataset(index, spec, augment=Augmentation(flip=1.0))
    assert sequences.place(1) == ("scene-0001", "CAM_FRONT", 6)

    for sample in (sequences[1], sequences[(1, 0)]):
        assert not sample["trajectory_valid"]
        assert sample["image"].shape == (6, 3, 30, 64)
        # One frame follows in the scene.
        assert sample["future"].isfinite().all(dim=1).tolist() == [True, False, False, False, False, False]
        assert sample["positions"].isfinite().all()


def test_positions_are_the_last_frame_s_past_and_its_origin(make):
    sample = make()[2]

    positions = sample["positions"]

    assert positions.shape == (6, 2)
    assert positions.dtype == torch.float32
    assert positions[-1].abs().max() < 1e-6
    np.testing.assert_allclose(positions[:-1], sample["past"][1:], atol=1e-5)
    assert sample["past"][1:].isfinite().all()


def test_all_six_are_augmented_alike(make):
    plain, flipped = make(), make(augment=Augmentation(colour=0.0, flip=1.0))
    before, after = plain[3], flipped[(3, 0)]

    torch.testing.assert_close(after["image"], before["image"].flip(-1), rtol=0, atol=0)
    torch.testing.assert_close(after["masks"], before["masks"].flip(-1), rtol=0, atol=0)
    mirror = torch.tensor([1.0, -1.0])
    for name in ("positions", "past", "future"):
        torch.testing.assert_close(after[name], before[name] * mirror, equal_nan=True)
    assert set(after) == set(before)
