"""Whether a shard's labels are stored as the schema asks for, and by the definitions of today."""

from collections.abc import Iterator

import h5py

from ogmkit.labels.catalogue import paper
from ogmkit.labels.definition import Definition, differing_fields
from ogmkit.shards.conformity import sizes
from ogmkit.shards.labels_stored import holds_labels_only, label_groups, stored_record
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_labels import (
    LABEL_ATTRIBUTES,
    POSES,
    SAMPLE_TOKENS,
    SURROUND,
    label_fields,
    label_group,
    label_sizes,
)
from ogmkit.shards.structure_parts import attribute_problems, field_problems


def label_problems(shard: Shard) -> Iterator[str]:
    """Describe whatever departs from the schema in the labels by name; reads no data.

    Raises:
        ShardError: a definition's record can't be read.
    """
    expected = {label_group(one).removeprefix("/"): one for one in shard.settings.labels}
    found = label_groups(shard.h5)
    for place in sorted(found.keys() | expected.keys()):
        if place not in expected:
            yield f"/{place} is not among the settings' definitions"
        elif place not in found:
            yield f"/{place} is missing"
        else:
            yield from _group_problems(shard, found[place], expected[place])
    yield from _paper_problems(shard)
    for name in sorted(shard.h5):
        if holds_labels_only(shard.h5[name]):
            yield from _place_problems(shard, shard.h5[name])


def _paper_problems(shard: Shard) -> Iterator[str]:
    """Of the cameras' records, which shards of earlier versions lack."""
    expected = paper(shard.settings.targets).to_dict()
    for camera in shard.cameras:
        group = shard.h5[camera]
        if isinstance(group, h5py.Group) and "definition" in group.attrs:
            for different in differing_fields(expected, stored_record(shard.path, group)):
                yield f"/{camera} is by another definition: {different}"


def _place_problems(shard: Shard, place: h5py.Group) -> Iterator[str]:
    """Of a group that holds labels alone."""
    there = [field for field in POSES if field.name in place] if place.name == f"/{SURROUND}" else []
    for field in (SAMPLE_TOKENS, *there):
        yield from field_problems(place, field, sizes(place, shard.grid))
    for name in sorted(set(place) - {SAMPLE_TOKENS.name, "labels", *(field.name for field in there)}):
        yield f"{place.name}/{name} is not in the schema"


def _group_problems(shard: Shard, group: h5py.Group, definition: Definition) -> Iterator[str]:
    problems = tuple(attribute_problems(group, LABEL_ATTRIBUTES, frozenset({"core"})))
    yield from problems
    if problems:
        return
    for different in differing_fields(definition.to_dict(), stored_record(shard.path, group)):
        yield f"{group.name} is by another definition: {different}"
    symbols = sizes(shard.h5[definition.place], shard.grid) | label_sizes(definition.to_dict())
    fields = label_fields(definition)
    for field in fields:
        yield from field_problems(group, field, symbols)
    for name in sorted(set(group) - {field.name for field in fields}):
        yield f"{group.name}/{name} is not in the schema"
