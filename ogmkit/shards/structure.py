"""Whether a shard has the datasets, shapes, types and attributes that the schema asks for."""

from collections.abc import Iterator

import h5py
import numpy as np

from ogmkit.shards import schema
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema import Attribute, Field


def structure_problems(shard: Shard) -> Iterator[str]:
    """Describe whatever departs from the schema; reads no data.

    Yields:
        A line for each departure, naming group, dataset or attribute.
    """
    yield from _attribute_problems(shard.h5, schema.FILE_ATTRIBUTES)
    expected = tuple(sorted(shard.settings.cameras))
    if shard.cameras != expected:
        yield f"cameras are {', '.join(shard.cameras) or 'none'}, by its settings {', '.join(expected)}"
    for camera in shard.cameras:
        group = shard.h5[camera]
        if isinstance(group, h5py.Group):
            yield from _attribute_problems(group, schema.CAMERA_ATTRIBUTES)
            yield from _camera_problems(shard, group)
        else:
            yield f"/{camera} is no group"


def sizes(shard: Shard, group: h5py.Group) -> dict[str, int]:
    """The values of the schema's symbols in a camera's group, from the datasets that define them."""
    frames = _length(group, "sample_token")
    return {
        schema.FRAMES: frames,
        schema.FRAMES_AND_END: frames + 1,
        schema.BOXES: _length(group, "boxes/annotation_token"),
        schema.POINTS: _length(group, "lidar/points"),
        schema.ROWS: shard.grid.rows,
        schema.COLUMNS: shard.grid.columns,
    }


def _length(group: h5py.Group, name: str) -> int:
    found = group.get(name)
    return len(found) if isinstance(found, h5py.Dataset) and found.shape else 0


def _camera_problems(shard: Shard, group: h5py.Group) -> Iterator[str]:
    targets = shard.settings.targets
    fields = schema.fields(image=targets.images == "bytes", lidar=targets.lidar)
    for field in fields:
        yield from _field_problems(group, field, field.resolved(sizes(shard, group)))
    known = {field.name for field in fields}
    names: list[str] = []
    group.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    for name in sorted(set(names) - known):
        yield f"{group.name}/{name} is not in the schema"


def _field_problems(group: h5py.Group, field: Field, shape: tuple[int, ...]) -> Iterator[str]:
    name = f"{group.name}/{field.name}"
    dataset = group.get(field.name)
    if not isinstance(dataset, h5py.Dataset):
        yield f"{name} is missing"
        return
    if dataset.shape != shape:
        yield f"{name} has shape {dataset.shape}, not {shape}"
    if not _same_dtype(dataset.dtype, field):
        yield f"{name} has dtype {dataset.dtype}, not {field.dtype}"
    for attribute in schema.DATASET_ATTRIBUTES:
        found, wanted = dataset.attrs.get(attribute), getattr(field, attribute)
        if found != wanted:
            yield f"{name} has {attribute} {found!r}, not {wanted!r}"


def _same_dtype(dtype: "np.dtype[np.generic]", field: Field) -> bool:
    if field.dtype == "text":
        text = h5py.check_string_dtype(dtype)
        return text is not None and text.encoding == "utf-8"
    if field.dtype == "bytes":
        return bool(h5py.check_vlen_dtype(dtype) == np.uint8)
    return dtype == field.h5_dtype


def _attribute_problems(owner: h5py.File | h5py.Group, attributes: tuple[Attribute, ...]) -> Iterator[str]:
    kinds = {str: str, int: np.integer, float: np.floating}
    for attribute in attributes:
        value = owner.attrs.get(attribute.name)
        if not isinstance(value, kinds[attribute.kind]):
            shown = "missing" if value is None else f"{value!r}, not a {attribute.kind.__name__}"
            yield f"{owner.name} attribute {attribute.name} is {shown}"
