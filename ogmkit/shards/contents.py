"""The datasets of a shard, as a list: `ogmkit inspect`."""

from dataclasses import dataclass

import h5py

from ogmkit.shards.labels_stored import label_groups, stored_record
from ogmkit.shards.reader import Shard
from ogmkit.shards.stored import reading


@dataclass(frozen=True)
class DatasetSummary:
    """A dataset of a camera.

    Attributes:
        name: below the camera's group, such as `boxes/offsets`.
        shape: its sides.
        type: of its values: a dtype of numpy, or `text`.
        holds: its description.
    """

    name: str
    shape: tuple[int, ...]
    type: str
    holds: str


@dataclass(frozen=True)
class LabelSummary:
    """Labels by name.

    Attributes:
        place: the group that they are below, such as `SURROUND`.
        definition: their name.
        version: of the definition.
        samples: their rows.
        arrays: names of the datasets, sorted.
    """

    place: str
    definition: str
    version: int
    samples: int
    arrays: tuple[str, ...]


def labels_in(shard: Shard) -> tuple[LabelSummary, ...]:
    """All labels by name of a shard.

    Raises:
        ShardError: a definition's record can't be read.
    """
    found = []
    with reading(shard.path):
        for place, group in label_groups(shard.h5).items():
            camera, _, name = place.split("/")
            version = int(stored_record(shard.path, group).get("version", 0))
            found.append(LabelSummary(camera, name, version, shard.frames(camera), tuple(sorted(group))))
    return tuple(found)


def datasets_of(shard: Shard, camera: str) -> tuple[DatasetSummary, ...]:
    """All datasets of a camera, also those of groups that were added, in the order of their names."""
    found: list[DatasetSummary] = []

    def add(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            text = h5py.check_string_dtype(item.dtype) is not None
            kind = "text" if text else str(h5py.check_vlen_dtype(item.dtype) or item.dtype)
            found.append(DatasetSummary(name, item.shape, kind, str(item.attrs.get("description", ""))))

    with reading(shard.path):
        shard.h5[camera].visititems(add)
    return tuple(found)
