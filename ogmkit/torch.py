"""Samples of shards as tensors, for networks of your own; needs the extra `train` (docs/api.md)."""

from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import BatchLoader, EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.data.surround import SurroundDataset
from ogmkit.samples.index import index_frames, index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.surround import index_surround
from ogmkit.samples.surround_spec import SurroundSpec

__all__ = [
    "Augmentation",
    "BatchLoader",
    "EpochBatches",
    "FrameDataset",
    "SampleSpec",
    "SequenceDataset",
    "SurroundDataset",
    "SurroundSpec",
    "index_frames",
    "index_sequences",
    "index_surround",
    "loader",
]
