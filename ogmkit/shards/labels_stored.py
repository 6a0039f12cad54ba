"""Groups of labels in a shard: which they are, and the records that they were made by."""

import json
from pathlib import Path
from typing import Any

import h5py

from ogmkit.errors import MALFORMED, ShardError
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.schema_labels import LABELS, SAMPLE_TOKENS, SURROUND, label_sizes


def holds_labels_only(item: h5py.Group | h5py.Dataset) -> bool:
    """Whether a group of a shard is no camera's frames."""
    alone = {SAMPLE_TOKENS.name, LABELS}
    return isinstance(item, h5py.Group) and (item.name == f"/{SURROUND}" or set(item) == alone)


def label_groups(h5: h5py.File) -> dict[str, h5py.Group]:
    """Place below the file, such as `SURROUND/labels/lss`, → group, of all labels by name."""
    found: dict[str, h5py.Group] = {}
    for place, item in sorted(h5.items()):
        below = item.get(LABELS) if isinstance(item, h5py.Group) else None
        if isinstance(below, h5py.Group):
            groups = {name: one for name, one in below.items() if isinstance(one, h5py.Group)}
            found |= {f"{place}/{LABELS}/{name}": group for name, group in groups.items()}
    return found


def stored_record(path: Path, group: h5py.Group) -> dict[str, Any]:
    """The record of the definition that a group was made by.

    Args:
        path: the shard's file, for messages.
        group: the definition's.

    Raises:
        ShardError: it has none that can be read.
    """
    try:
        record = json.loads(group.attrs["definition"])
        label_sizes(record)
        return dict(record)
    except MALFORMED as error:
        raise ShardError(f"{path}: {group.name} has no sound definition ({error!r}); {REMEDY}") from error


def stored_sizes(path: Path, dataset: h5py.Dataset) -> dict[str, int]:
    """Rows and columns of an array of labels, by its group's record; nothing of any other dataset.

    Raises:
        ShardError: as `stored_record`.
    """
    parts = str(dataset.name).split("/")
    if len(parts) != 5 or parts[2] != LABELS:
        return {}
    return label_sizes(stored_record(path, dataset.parent))
