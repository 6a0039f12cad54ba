"""Making datasets as the schema describes them."""

import zlib
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ogmkit.shards import schema
from ogmkit.shards.fields import Attribute, Field, Part
from ogmkit.shards.settings import Compression

_FILTERS: dict[Compression, dict[str, Any]] = {
    # Level 1: masks shrink 45-fold at the cost of a copy; level 9 halves that for twelve times the time.
    "gzip": {"compression": "gzip", "compression_opts": 1},
    "lzf": {"compression": "lzf"},
    "none": {},
}
_POINTS_PER_CHUNK = 8192
_MEMORY = 4
"""zlib's `memLevel`, so that its tables fit the processor's first cache: masks in four fifths of the time."""
_ALWAYS: frozenset[Part] = frozenset({"core"})


class Rows:
    """A dataset that is filled row by row, each in the file at once.

    HDF5 writes what it holds when the dataset is closed, else; and whoever holds on to this thread's frames,
    such as a profiler, puts that off, so that the same rows would give a file of another order.

    Args:
        dataset: in a file that is being written.
    """

    def __init__(self, dataset: h5py.Dataset) -> None:
        self._dataset = dataset
        self._type = dataset.dtype
        in_chunks = dataset.chunks is not None and dataset.chunks[0] == 1
        self._level = dataset.compression_opts if in_chunks and dataset.compression == "gzip" else None

    def store(self, row: int, values: ArrayLike) -> None:
        """Fill a row."""
        if self._level is None:
            self._dataset[row] = values
            self._dataset.flush()
            return
        # What HDF5's filter does when it reads them needs no more; writing by it would copy them twice.
        pictures = np.ascontiguousarray(values, self._type)
        for place in np.ndindex(pictures.shape[:-2]):
            chunk = _deflated(pictures[place], self._level)
            self._dataset.id.write_direct_chunk((row, *place, 0, 0), chunk)

    def append(self, values: ArrayLike) -> int:
        """Add rows at the end; their number."""
        rows = np.asarray(values)
        first = len(self._dataset)
        self._dataset.resize(first + len(rows), axis=0)
        self._dataset[first:] = rows
        self._dataset.flush()
        return len(rows)


def _deflated(picture: NDArray[Any], level: int) -> bytes:
    """A chunk as HDF5's gzip filter reads it.

    Runs alone (Z_RLE) would halve a mask and take five times as long to read: zlib copies them byte by byte.
    """
    stream = zlib.compressobj(level, zlib.DEFLATED, zlib.MAX_WBITS, _MEMORY)
    return stream.compress(picture.data) + stream.flush()


def create_dataset(
    group: h5py.Group, field: Field, sizes: Mapping[str, int], compression: Compression
) -> Rows:
    """Make a dataset that is filled frame by frame afterwards.

    Args:
        group: the camera's group, or one added below it.
        field: what it holds.
        sizes: values of the shape's symbols.
        compression: of rasters and points.
    """
    shape = field.resolved(sizes)
    layout: dict[str, Any] = {"name": field.name, "shape": shape, "dtype": field.h5_dtype}
    if field.storage == "rasters":
        layout |= {"chunks": (*(1 for _ in shape[:-2]), *shape[-2:])} | _FILTERS[compression]
    elif field.storage == "rows":
        chunks = (_POINTS_PER_CHUNK, *shape[1:])
        layout |= {"maxshape": (None, *shape[1:]), "chunks": chunks} | _FILTERS[compression]
    return Rows(_described(group.create_dataset(**layout), field))


def store_dataset(group: h5py.Group, field: Field, rows: ArrayLike, sizes: Mapping[str, int]) -> None:
    """Make a dataset of all its rows at once."""
    data = np.asarray(rows, field.memory_dtype).reshape(field.resolved(sizes))
    _described(group.create_dataset(field.name, data=data, dtype=field.h5_dtype), field)


def attribute_values(
    attributes: Sequence[Attribute], values: Mapping[str, Any], parts: Collection[Part] = _ALWAYS
) -> dict[str, Any]:
    """The values of those attributes that belong to some parts of the schema, in their kinds.

    Raises:
        KeyError: one of them has no value.
    """
    stored = (attribute for attribute in attributes if attribute.part in parts)
    return {attribute.name: attribute.kind(values[attribute.name]) for attribute in stored}


def _described(dataset: h5py.Dataset, field: Field) -> h5py.Dataset:
    dataset.attrs.update({name: getattr(field, name) for name in schema.DATASET_ATTRIBUTES})
    return dataset
