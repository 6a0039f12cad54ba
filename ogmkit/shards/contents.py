"""The datasets of a shard, as a list: `ogmkit inspect`."""

from dataclasses import dataclass

import h5py

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
