"""Whether a shard has the datasets, shapes, types and attributes that the schema asks for."""

from collections.abc import Iterator, Mapping, Sequence

import h5py

from ogmkit.shards import fields, schema
from ogmkit.shards.conformity import mask_sizes, sizes
from ogmkit.shards.fields import AddedKind, Field, Part
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_further import further_fields
from ogmkit.shards.schema_labels import LABELS
from ogmkit.shards.stored import reading
from ogmkit.shards.structure_labels import label_problems
from ogmkit.shards.structure_parts import attribute_problems, field_problems


def structure_problems(shard: Shard) -> Iterator[str]:
    """Describe whatever departs from the schema; reads no data.

    Yields:
        A line for each departure, naming group, dataset or attribute.

    Raises:
        ShardError: the shard is damaged inside, or can't be read.
    """
    with reading(shard.path):
        yield from _problems(shard)


def _problems(shard: Shard) -> Iterator[str]:
    targets = shard.settings.targets
    yield from label_problems(shard)
    yield from attribute_problems(shard.h5, schema.FILE_ATTRIBUTES, fields.parts_of(targets))
    expected = tuple(sorted(shard.settings.cameras))
    if shard.cameras != expected:
        yield f"cameras are {', '.join(shard.cameras) or 'none'}, by its settings {', '.join(expected)}"
    for camera in shard.cameras:
        group = shard.h5[camera]
        if isinstance(group, h5py.Group):
            parts = fields.parts_of(targets, left_out=fields.LEFT_OUT_GROUP in group)
            yield from attribute_problems(group, schema.CAMERA_ATTRIBUTES, parts)
            yield from _camera_problems(shard, group, parts)
        else:
            yield f"/{camera} is not a group"


def _camera_problems(shard: Shard, group: h5py.Group, parts: frozenset[Part]) -> Iterator[str]:
    targets = shard.settings.targets
    stored = (*schema.fields(parts), *further_fields(targets))
    symbols = sizes(group, shard.grid) | {fields.FUTURE: targets.future}
    for field in stored:
        yield from field_problems(group, field, symbols)
    known = {field.name for field in stored}
    for kind in schema.ADDED:
        for name in shard.added(_channel(group), kind.name):
            added = group[kind.name][name]
            if isinstance(added, h5py.Group):
                possible = [field for field in kind.fields if field.part in {*parts, "optional"}]
                yield from attribute_problems(added, kind.attributes, parts)
                yield from _added_problems(kind, added, possible, symbols)
                known |= {f"{kind.name}/{name}/{field.name}" for field in possible}
    names: list[str] = []
    group.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    for name in sorted(name for name in set(names) - known if not name.startswith(f"{LABELS}/")):
        yield f"{group.name}/{name} is not in the schema"


def _added_problems(
    kind: AddedKind, added: h5py.Group, possible: Sequence[Field], symbols: Mapping[str, int]
) -> Iterator[str]:
    symbols = {**symbols, **mask_sizes(kind, added)}
    for field in possible:
        if field.part != "optional" or field.name in added:
            yield from field_problems(added, field, symbols)


def _channel(group: h5py.Group) -> str:
    return str(group.name).removeprefix("/")
