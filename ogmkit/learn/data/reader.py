"""Samples of an index as arrays; small ones are read once, and kept."""

from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ogmkit.learn.data.frame_features import FrameFeatures
from ogmkit.learn.data.pixel_cache import PixelCache
from ogmkit.learn.data.pool import ShardPool
from ogmkit.samples.arrays import SampleArrays
from ogmkit.samples.index import FrameIndex
from ogmkit.samples.pooling import Counts, shares
from ogmkit.samples.reading import Rows, read_part_counts, read_pixels, read_sample
from ogmkit.samples.spec import SampleSpec

MOST_KEPT_BYTES = 1 << 30
"""What a process keeps at most for one data set; samples that come later are read again each time."""
_PATH_BYTES = 2200
"""Of a sample's trajectories, with what Python takes for them; measured: 2.2 kB."""

_Value = TypeVar("_Value")


class SampleReader:
    """Reads samples; those of trajectories and averages over parts alone stay in the process's memory.

    A frame is part of six sequences, so averages are kept by frame: as numbers of cells, a byte for a part of
    up to 255 of them.

    Args:
        index: which samples.
        spec: what they hold.
    """

    def __init__(self, index: FrameIndex, spec: SampleSpec) -> None:
        self._index = index
        self._spec = spec
        self._pool = ShardPool(index.paths)
        self._kept: dict[object, Any] = {}
        self._bytes = 0
        self._pixels: PixelCache | None = None
        self._features: FrameFeatures | None = None

    def keep_pixels(self, path: Path) -> None:
        """Keep decoded, resized images and masks in a file, which is made.

        Raises:
            OutputError: as `PixelCache`.
        """
        if self._spec.image_size is not None:
            self._pixels = PixelCache(path, self._index, self._spec)

    def keep_features(self, features: FrameFeatures) -> None:
        """From now on, samples hold trajectories and these features, and no more of their frames."""
        self._features = features

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}, "_bytes": 0}

    def rows(self, i: int) -> Rows:
        """A sample's frames in their open shard."""
        return self._rows(i, tuple(self._index.rows[i].tolist()))

    def read(self, i: int) -> SampleArrays:
        """Read a sample, or take it from memory; nobody changes its arrays.

        Raises:
            ShardError, DataFileError: as `read_sample`.
        """
        if self._features is None:
            return self.read_whole(i)
        return replace(self._path(i), features=self._features.read(i))

    def read_whole(self, i: int) -> SampleArrays:
        """The same, with all that the specification names even where features are kept."""
        if not self._spec.is_small:
            frames, root = self.rows(i), self._index.image_root
            pixels = None
            if self._pixels is not None:
                pixels = self._pixels.read(i, lambda: read_pixels(frames, self._spec, root))
            return read_sample(frames, self._spec, root, pixels)
        path, parts = self._path(i), self._spec.bev_parts
        if parts is None:
            return path
        counts = np.stack([self._counts(i, row, parts) for row in self._index.rows[i].tolist()])
        return replace(path, bev_parts=shares(counts, self._index.grid.shape))

    def _rows(self, i: int, rows: tuple[int, ...]) -> Rows:
        shard = self._pool.shard(int(self._index.shard[i]))
        return Rows(shard, self._index.cameras[self._index.camera[i]], rows)

    def _path(self, i: int) -> SampleArrays:
        """A sample's trajectories, kept."""
        return self._keep(i, lambda: self._read_path(i), lambda _: _PATH_BYTES)

    def _read_path(self, i: int) -> SampleArrays:
        """The same, in arrays that hold on to no others."""
        found = read_sample(self.rows(i), SampleSpec(trajectory=self._spec.trajectory), None)
        values = {one.name: getattr(found, one.name) for one in fields(found)}
        arrays: dict[str, Any] = {
            name: value.copy() for name, value in values.items() if isinstance(value, np.ndarray)
        }
        return replace(found, **arrays)

    def _counts(self, i: int, row: int, parts: tuple[int, int]) -> Counts:
        """(2, r, c) cells of each part that are set in one of a sample's frames."""
        place = int(self._index.shard[i]), int(self._index.camera[i]), row

        def read() -> Counts:
            counts: Counts = read_part_counts(self._rows(i, (row,)), parts)[0]
            return counts

        return self._keep(place, read, lambda counts: counts.nbytes)

    def _keep(self, key: object, read: Callable[[], _Value], size_of: Callable[[_Value], int]) -> _Value:
        """What is kept by a key, or is read and kept while there is room."""
        if key in self._kept:
            found: _Value = self._kept[key]
            return found
        value = read()
        if self._bytes < MOST_KEPT_BYTES:
            self._kept[key] = value
            self._bytes += size_of(value)
        return value
