"""Samples of shards as tensors, for networks of your own; needs the extra `train` (docs/api.md)."""

from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import BatchLoader, EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.spec import SampleSpec

__all__ = [
    "Augmentation",
    "BatchLoader",
    "EpochBatches",
    "FrameDataset",
    "SampleSpec",
    "SequenceDataset",
    "index_frames",
    "index_sequences",
    "loader",
]
