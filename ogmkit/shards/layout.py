"""Making datasets as the schema describes them."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike

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
_ALWAYS: frozenset[Part] = frozenset({"core"})


def create_dataset(
    group: h5py.Group, field: Field, sizes: Mapping[str, int], compression: Compression
) -> h5py.Dataset:
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
    return _described(group.create_dataset(**layout), field)


def store_row(dataset: h5py.Dataset, row: int | slice, values: ArrayLike) -> None:
    """Fill a row, in the file at once.

    HDF5 writes it when the dataset is closed, else; and whoever holds on to this thread's frames, such as a
    profiler, puts that off, so that the same rows would give a file of another order.
    """
    dataset[row] = values
    dataset.flush()


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
