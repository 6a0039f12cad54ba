"""What a row of an export holds: a frame's values by the names of its datasets."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import h5py
import numpy as np

from ogmkit.shards import fields
from ogmkit.shards.fields import Field
from ogmkit.shards.labels_stored import holds_labels_only
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema import field_of
from ogmkit.shards.stored import reading

Table = Literal["cameras", "surround"]
"""Rows by a camera's frames, or by the samples of labels round the vehicle."""
Form = Literal["image", "picture", "array", "text", "values"]
"""A file as it is; an integer raster; an array of many numbers; a text; numbers and texts of a few rows."""

TABLES: tuple[Table, ...] = ("cameras", "surround")
_PICTURES = ("uint8", "uint16")
_RASTER_SIDES = {fields.ROWS, fields.COLUMNS, fields.HEIGHT, fields.WIDTH}
_OFFSETS = {fields.BOXES: "boxes/offsets", fields.POINTS: "lidar/offsets"}
"""Symbol of datasets whose rows a frame owns several of → where it says which."""


@dataclass(frozen=True)
class Column:
    """One dataset of a group, as rows of an export have it.

    Attributes:
        name: below the group, such as `trajectory/future`.
        field: what the schema says of it.
    """

    name: str
    field: Field

    @property
    def form(self) -> Form:
        """How its values are written."""
        if self.field.dtype == "bytes":
            return "image"
        if _RASTER_SIDES & set(self.field.shape):
            return "picture" if self.field.dtype in _PICTURES and len(self.field.shape) == 3 else "array"
        if self.field.shape[0] == fields.POINTS:
            return "array"
        return "text" if self.field.dtype == "text" and not self.several else "values"

    @property
    def several(self) -> bool:
        """Whether a frame owns several of the dataset's rows: boxes, points."""
        return self.field.shape[0] in _OFFSETS

    @property
    def dimensions(self) -> int:
        """Of a frame's value."""
        return len(self.field.shape) - 1 + self.several


@dataclass(frozen=True, eq=False)
class Row:
    """One frame, or one sample of labels round the vehicle.

    Attributes:
        scene: the scene's name.
        group: channel, or `SURROUND`.
        frame: place among the group's, from 0.
        values: column → value: bytes of images, texts, arrays of the field's dtype.
    """

    scene: str
    group: str
    frame: int
    values: Mapping[str, Any]


def groups_of(shard: Shard, table: Table) -> tuple[str, ...]:
    """The groups of a shard whose rows a table holds, sorted."""
    if table == "cameras":
        return shard.cameras
    with reading(shard.path):
        return tuple(sorted(name for name, group in shard.h5.items() if holds_labels_only(group)))


def columns_of(shard: Shard, group: str) -> tuple[Column, ...]:
    """The columns of a group's rows, by name; frames that are left out have no row, and no column either."""
    names: list[str] = []

    def note(name: str, item: h5py.Dataset | h5py.Group) -> None:
        if isinstance(item, h5py.Dataset):
            names.append(name)

    with reading(shard.path):
        shard.h5[group].visititems(note)
    found = ((name, field_of(name)) for name in sorted(names))
    owned = {fields.FRAMES, *_OFFSETS}
    return tuple(Column(name, field) for name, field in found if field and field.shape[0] in owned)


def rows_of(shard: Shard, group: str, columns: tuple[Column, ...]) -> Iterator[Row]:
    """The rows of a group, in order; of large datasets one frame's values are held at a time.

    Raises:
        ShardError: the shard is damaged, or isn't as the schema says.
    """
    readers = {column.name: _Reader(shard, group, column) for column in columns}
    for frame in range(shard.frames(group)):
        yield Row(shard.scene, group, frame, {name: read(frame) for name, read in readers.items()})


def plain(value: Any) -> Any:  # noqa: ANN401  # as the column's form says
    """Texts, numbers and lists of lists of them."""
    return value if isinstance(value, str) else np.asarray(value).tolist()


class _Reader:
    """Values of one column, frame by frame: small datasets are read at once."""

    def __init__(self, shard: Shard, group: str, column: Column) -> None:
        self._stored, self._text = shard.dataset(group, column.name), column.field.dtype == "text"
        self._offsets = None
        if column.several:
            self._offsets = shard.dataset(group, _OFFSETS[str(column.field.shape[0])])[:]
        self._whole = None
        if column.form in ("text", "values"):
            self._whole = self._stored.texts(slice(None)) if self._text else self._stored[:]

    def __call__(self, frame: int) -> Any:  # noqa: ANN401  # as the column's form says
        source = self._stored if self._whole is None else self._whole
        if self._offsets is None:
            return source[frame]
        first, stop = self._offsets[frame : frame + 2]
        return source[int(first) : int(stop)]
