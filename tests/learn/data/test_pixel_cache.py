"""Samples whose images and masks are kept in a file are the same, and are decoded once."""

import pickle
import shutil
from types import SimpleNamespace

import pytest
import torch

from ogmkit.errors import OutputError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.samples import reading
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.spec import SampleSpec

SCENES, CAMERAS = ["scene-0001", "scene-0002"], ["CAM_BACK", "CAM_FRONT"]


@pytest.fixture
def decoded(monkeypatch):
    """Places of images as they are decoded."""
    places, decode = [], reading.decode_resized

    def counted(file, source, size, place):
        places.append(place)
        return decode(file, source, size, place)

    monkeypatch.setattr(reading, "decode_resized", counted)
    return places


def assert_equal(one, other):
    assert one.keys() == other.keys()
    assert all(torch.equal(one[name], other[name]) for name in one)


@pytest.mark.parametrize(
    "spec",
    [
        SampleSpec((30, 64)),
        SampleSpec((30, 64), masks="calibration", homography="calibration", calibration=True),
        SampleSpec((30, 64), masks="calibration", image=False),
    ],
)
def test_frames_are_the_same_and_decoded_once(sample_shards, tmp_path, decoded, spec):
    index = index_frames(sample_shards, SCENES, CAMERAS, needs=spec)
    plain, kept = (FrameDataset(index, spec, augment=Augmentation(0.2, 0.5)) for _ in range(2))
    kept.keep_pixels(tmp_path / "pixels")
    keys = [(i, 7 * i + round_) for round_ in range(2) for i in range(len(index))]
    expected = [plain[key] for key in keys]
    decoded.clear()
    for key, sample in zip(keys, expected, strict=True):
        assert_equal(kept[key], sample)
    assert len(decoded) == (len(index) if spec.image else 0)


def test_a_frame_of_several_sequences_has_one_place(plan_shards, tmp_path, decoded):
    spec = SampleSpec((30, 64), masks="surface", trajectory=True)
    index = index_sequences(plan_shards, SCENES, ["CAM_FRONT"], needs=spec)
    plain, kept = SequenceDataset(index, spec), SequenceDataset(index, spec)
    kept.keep_pixels(tmp_path / "pixels")
    other = pickle.loads(pickle.dumps(kept))  # as a worker process gets it
    for i in range(len(index)):
        assert_equal(kept[i], plain[i])
    decoded.clear()
    for i in range(len(index)):
        assert_equal(other[i], plain[i])
    assert len(decoded) == 6 * len(index)  # the plain ones
    assert (tmp_path / "pixels").stat().st_size == 2 * 9 * (5 * 30 * 64 + 1)


def test_room_is_asked_for_first(sample_shards, tmp_path, monkeypatch):
    spec = SampleSpec((30, 64))
    samples = FrameDataset(index_frames(sample_shards, SCENES, CAMERAS, needs=spec), spec)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1000))
    with pytest.raises(OutputError, match=r"--cache-samples needs 0\.0 GB, 0\.0 GB are free"):
        samples.keep_pixels(tmp_path / "pixels")
    assert list(tmp_path.iterdir()) == []


def test_a_training_is_the_same_and_leaves_no_file(sample_shards, tmp_path):
    from ogmkit.learn.training.train import train

    weights = []
    for cached in (False, True):
        settings = CATALOGUE["footprints"].settings(
            image_size=(64, 96),
            encoder="tu-test_resnet",
            masks="calibration",
            epochs=2,
            batch_size=8,
            flip=0.5,
            train_split="train",
            val_split="val",
            cache_samples=cached,
        )
        run = tmp_path / str(cached)
        train(settings, sample_shards, run)
        state = torch.load(run / "last.ckpt", weights_only=True)["state_dict"]
        weights.append({name: value.clone() for name, value in state.items()})
        assert not [path for path in run.iterdir() if path.name.endswith(".part")]
    assert_equal(*weights)
