"""Whether a shard has the datasets, shapes, types and attributes that the schema asks for."""

from collections.abc import Iterator, Mapping

import h5py
import numpy as np

from ogmkit.shards import fields, schema
from ogmkit.shards.fields import AddedKind, Attribute, Field
from ogmkit.shards.reader import Shard


def structure_problems(shard: Shard) -> Iterator[str]:
    """Describe whatever departs from the schema; reads no data.

    Yields:
        A line for each departure, naming group, dataset or attribute.
    """
    links = tuple(_link_problems(shard.h5))
    yield from links
    if links:
        return  # nothing outside the file is read
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
            yield f"/{camera} is not a group"


def sizes(shard: Shard, group: h5py.Group) -> dict[str, int]:
    """The values of the schema's symbols in a camera's group, from the datasets that define them."""
    frames = _length(group, "sample_token")
    return {
        fields.FRAMES: frames,
        fields.FRAMES_AND_END: frames + 1,
        fields.BOXES: _length(group, "boxes/annotation_token"),
        fields.POINTS: _length(group, "lidar/points"),
        fields.ROWS: shard.grid.rows,
        fields.COLUMNS: shard.grid.columns,
    }


def _link_problems(group: h5py.Group) -> Iterator[str]:
    """Name links to other files or places: a shard holds its data itself."""
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            yield f"{group.name.rstrip('/')}/{name} is a link to another place, not data"
        elif group.get(name, getclass=True) is h5py.Group:
            yield from _link_problems(group[name])


def _length(group: h5py.Group, name: str) -> int:
    found = group.get(name)
    return len(found) if isinstance(found, h5py.Dataset) and found.shape else 0


def _camera_problems(shard: Shard, group: h5py.Group) -> Iterator[str]:
    targets = shard.settings.targets
    stored = schema.fields(image=targets.images == "bytes", lidar=targets.lidar)
    symbols = sizes(shard, group)
    for field in stored:
        yield from _field_problems(group, field, symbols)
    known = {field.name for field in stored}
    for kind in schema.ADDED:
        for name in shard.added(_channel(group), kind.name):
            added = group[kind.name][name]
            if isinstance(added, h5py.Group):
                yield from _added_problems(kind, added, symbols)
                known |= {f"{kind.name}/{name}/{field.name}" for field in kind.fields}
    names: list[str] = []
    group.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    for name in sorted(set(names) - known):
        yield f"{group.name}/{name} is not in the schema"


def _added_problems(kind: AddedKind, added: h5py.Group, symbols: Mapping[str, int]) -> Iterator[str]:
    yield from _attribute_problems(added, kind.attributes)
    symbols = {**symbols, **_mask_size(kind, added)}
    for field in kind.fields:
        if field.part != "optional" or field.name in added:
            yield from _field_problems(added, field, symbols)


def _mask_size(kind: AddedKind, added: h5py.Group) -> dict[str, int]:
    """Height and width as the first masks have them: all others must agree."""
    masks = (added.get(field.name) for field in kind.fields if fields.HEIGHT in field.shape)
    shapes = (found.shape for found in masks if isinstance(found, h5py.Dataset) and found.ndim == 3)
    _, height, width = next(shapes, (0, 0, 0))
    return {fields.HEIGHT: height, fields.WIDTH: width}


def _channel(group: h5py.Group) -> str:
    return str(group.name).removeprefix("/")


def _field_problems(group: h5py.Group, field: Field, symbols: Mapping[str, int]) -> Iterator[str]:
    name, shape = f"{group.name}/{field.name}", field.resolved(symbols)
    dataset = group.get(field.name)
    if not isinstance(dataset, h5py.Dataset):
        yield f"{name} is missing"
        return
    if dataset.external or dataset.is_virtual:
        yield f"{name} keeps its data in another file"
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
