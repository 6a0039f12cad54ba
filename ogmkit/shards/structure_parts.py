"""Whether one dataset, or the attributes of one group, are as the schema asks for."""

from collections.abc import Iterator, Mapping, Sequence

import h5py

from ogmkit.shards import schema
from ogmkit.shards.conformity import departures
from ogmkit.shards.fields import Attribute, Field, Part


def field_problems(group: h5py.Group, field: Field, symbols: Mapping[str, int]) -> Iterator[str]:
    """Describe where a dataset of a group departs from its field; reads no data."""
    name = f"{group.name}/{field.name}"
    dataset = group.get(field.name)
    if not isinstance(dataset, h5py.Dataset):
        yield f"{name} is missing"
        return
    yield from (f"{name} {problem}" for problem in departures(dataset, field, symbols))
    for attribute in schema.DATASET_ATTRIBUTES:
        found, wanted = dataset.attrs.get(attribute), getattr(field, attribute)
        if found != wanted:
            yield f"{name} has {attribute} {found!r}, not {wanted!r}"


def attribute_problems(
    owner: h5py.File | h5py.Group, attributes: Sequence[Attribute], parts: frozenset[Part]
) -> Iterator[str]:
    """Describe attributes of these parts that are missing or of another kind."""
    for attribute in attributes:
        value = owner.attrs.get(attribute.name)
        problem = attribute.problem(value)
        if problem and not (value is None and attribute.part not in parts):
            yield f"{owner.name} attribute {attribute.name} is {problem}"
