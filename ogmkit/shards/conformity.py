"""Whether a dataset is stored where, in the shape and with the dtype that the schema says."""

from collections.abc import Iterator, Mapping

import h5py
import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.shards import fields
from ogmkit.shards.fields import AddedKind, Field


def sizes(group: h5py.Group, grid: GridSpec) -> dict[str, int]:
    """The values of the schema's symbols in a camera's group, from the datasets that define them."""
    frames = _length(group, "sample_token")
    return {
        fields.FRAMES: frames,
        fields.FRAMES_AND_END: frames + 1,
        fields.BOXES: _length(group, "boxes/annotation_token"),
        fields.POINTS: _length(group, "lidar/points"),
        fields.LEFT_OUT: _length(group, f"{fields.LEFT_OUT_GROUP}/sample_data_token"),
        fields.INSTANCES: _length(group, "instances/token"),
        fields.FUTURE: _width(group, "future/valid"),
        fields.ROWS: grid.rows,
        fields.COLUMNS: grid.columns,
    }


def mask_sizes(kind: AddedKind, added: h5py.Group) -> dict[str, int]:
    """Height and width as an added group's first masks have them: all others must agree."""
    masks = (added.get(field.name) for field in kind.fields if fields.HEIGHT in field.shape)
    shapes = (found.shape for found in masks if isinstance(found, h5py.Dataset) and found.ndim == 3)
    _, height, width = next(shapes, (0, 0, 0))
    return {fields.HEIGHT: height, fields.WIDTH: width}


def departures(dataset: h5py.Dataset, field: Field, symbols: Mapping[str, int]) -> Iterator[str]:
    """Describe where a dataset departs from its field; nothing of it is read.

    Args:
        dataset: the dataset.
        field: what the schema says of it.
        symbols: their values.

    Yields:
        What is wrong, to be put after the dataset's name.
    """
    shape = field.resolved(symbols)
    if dataset.external or dataset.is_virtual:
        yield "keeps its data in another file"
    if dataset.shape != shape:
        yield f"has shape {dataset.shape}, not {shape}"
    if not _same_dtype(dataset.dtype, field):
        yield f"has dtype {dataset.dtype}, not {field.dtype}"


def _length(group: h5py.Group, name: str) -> int:
    found = group.get(name)
    return len(found) if isinstance(found, h5py.Dataset) and found.shape else 0


def _width(group: h5py.Group, name: str) -> int:
    found = group.get(name)
    return int(found.shape[1]) if isinstance(found, h5py.Dataset) and found.ndim > 1 else 0


def _same_dtype(dtype: "np.dtype[np.generic]", field: Field) -> bool:
    if field.dtype == "text":
        text = h5py.check_string_dtype(dtype)
        return text is not None and text.encoding == "utf-8"
    if field.dtype == "bytes":
        return bool(h5py.check_vlen_dtype(dtype) == np.uint8)
    return dtype == field.h5_dtype
