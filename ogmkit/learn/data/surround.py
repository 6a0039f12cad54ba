"""Samples round the vehicle: a key frame's images with the labels about it, as tensors."""

import torch
from torch.utils.data import Dataset

from ogmkit.learn.data.pool import ShardPool
from ogmkit.learn.data.surround_layouts import LAYOUTS
from ogmkit.learn.data.tensors import Sample
from ogmkit.samples.surround import SurroundIndex
from ogmkit.samples.surround_reading import read_surround
from ogmkit.samples.surround_spec import SurroundSpec


class SurroundDataset(Dataset[Sample]):
    """Key frames of shards that all cameras saw, C images each with K classes of labels.

    The frame of reference is the plane of the labels' definition with the height over it; of `surround` it is
    the level frame of the sample, at the time of its sweep. Images are of their own times, and so are the
    transforms from their cameras. A sample is a dictionary; in the layout `ogmkit` it holds

    - `image`: (C, 3, h, w) float32 RGB, 0 … 1, resized and cropped.
    - `intrinsics`: (C, 3, 3) float64 of `image`; `reference_from_camera`: (C, 4, 4) float64.
    - `labels`: (K, rows, columns) float32 0/1, rows and columns as the definition has them.
    - `visibility`: (rows, columns) uint8, the level of the box drawn last, 255 for none.
    - `nearness`: (rows, columns) float32 exp(−d²), d cells from a box's centre; 0 without one.
    - `seen`: (rows, columns) bool, whether an image shows the cell's centre by calibration, the ground flat.

    Other layouts have the names and shapes that the networks of those repositories take
    (`ogmkit.learn.data.surround_layouts`). In all of them there is `index`, () int64 place in the dataset.

    Args:
        index: which key frames.
        spec: what samples hold, as the index was made for.

    Attributes:
        cameras: channels, in the order of the images.
        definition: of the labels.
    """

    def __init__(self, index: SurroundIndex, spec: SurroundSpec) -> None:
        self.cameras = index.cameras
        self.definition = index.definition
        self._index = index
        self._spec = spec
        self._pool = ShardPool(index.paths)

    def __len__(self) -> int:
        return len(self._index)

    def __getitem__(self, key: int | tuple[int, int]) -> Sample:
        """Read a sample.

        Args:
            key: its place; a seed beside it, as `EpochBatches` gives one, changes nothing.

        Raises:
            ShardError: the shard is damaged.
            DataFileError: an image is absent or damaged.
        """
        i = key if isinstance(key, int) else key[0]
        shard = self._pool.shard(int(self._index.shard[i]))
        arrays = read_surround(shard, self._index, i, self._spec)
        return LAYOUTS[self._spec.layout](arrays, self.definition) | {"index": torch.tensor(i)}
