"""The schema as documentation."""

from collections.abc import Iterator, Mapping

from ogmkit.shards import schema
from ogmkit.shards.fields import AddedKind, Field, Part
from ogmkit.shards.schema_further import FURTHER_FIELDS
from ogmkit.shards.schema_labels import (
    LABEL_ATTRIBUTES,
    LABEL_FIELDS,
    LABELS,
    POSES,
    SAMPLE_TOKENS,
    SURROUND,
)

_WHEN: Mapping[Part, str] = {
    "core": "",
    "map": " (not with `--no-map`)",
    "no map": " (with `--no-map`)",
    "image": " (with `--images bytes`)",
    "lidar": " (with `--lidar`)",
    "rays": " (with `--seen rays`)",
    "reach": " (with `--seen lidar`)",
    "left out": " (where frames are left out)",
    "layers": " (with `--layers`)",
    "classes": " (with `--classes`)",
    "instances": " (with `--instances`)",
    "flow": " (with `--instances --flow`)",
    "future": " (with `--future n`)",
    "optional": " (optional)",
}

_LABELS = {
    f"/{SURROUND}": (SAMPLE_TOKENS, *POSES),
    f"/{SURROUND}/{LABELS}/<definition>": LABEL_FIELDS,
}
"""Place → datasets of labels by name."""


def schema_markdown() -> str:
    """The schema as Markdown tables: a camera's group, groups added to it, labels by name, attributes."""
    tables = [_dataset_lines("`/<CAMERA>/…`", (*schema.FIELDS, *FURTHER_FIELDS, *schema.LEFT_OUT_FIELDS))]
    tables += [_dataset_lines(f"`{_place(kind)}/…`", kind.fields) for kind in schema.ADDED]
    tables += [_dataset_lines(f"`{place}/…`", fields) for place, fields in _LABELS.items()]
    return "\n\n".join("\n".join(lines) for lines in (*tables, _attribute_lines())) + "\n"


def _place(kind: AddedKind) -> str:
    return f"/<CAMERA>/{kind.name}/<{kind.member}>"


def _dataset_lines(heading: str, fields: tuple[Field, ...]) -> Iterator[str]:
    yield f"| {heading} | dtype | shape | meaning | units | frame |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for field in fields:
        shape = ", ".join(str(size) for size in field.shape)
        meaning = field.description + _WHEN[field.part]
        yield f"| `{field.name}` | {field.dtype} | ({shape}) | {meaning} | {field.units} | {field.frame} |"


def _attribute_lines() -> Iterator[str]:
    yield "| attribute of | name | type | meaning |"
    yield "| --- | --- | --- | --- |"
    owners = [("file", schema.FILE_ATTRIBUTES), ("`/<CAMERA>`", schema.CAMERA_ATTRIBUTES)]
    owners += [(f"`{_place(kind)}`", kind.attributes) for kind in schema.ADDED]
    owners += [(f"`/{SURROUND}/{LABELS}/<definition>`", LABEL_ATTRIBUTES)]
    for owner, attributes in owners:
        for attribute in attributes:
            name, kind = attribute.name, attribute.kind.__name__
            meaning = attribute.description + _WHEN[attribute.part]
            yield f"| {owner} | `{name}` | {kind} | {meaning} |"
