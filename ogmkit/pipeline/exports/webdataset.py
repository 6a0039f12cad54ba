"""Tar files as WebDataset reads them: the files of a sample stand together and share what precedes a dot."""

import io
import json
import math
import tarfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.base.images import PNG_START
from ogmkit.pipeline.exports.columns import Column, Row, Table, columns_of, groups_of, plain, rows_of
from ogmkit.pipeline.exports.pictures import png_of
from ogmkit.shards.reader import Shard

SUFFIX = ".tar"


def write_tar(shard: Shard, table: Table, splits: Sequence[str], path: Path) -> None:
    """Write a scene's rows, one after the other.

    A sample has `json` (small values, and where it is from), `jpg` or `png` (the camera's image), a PNG for
    each integer raster and an `npy` for each other array, named by their datasets with dots: `drivable.png`.

    Args:
        shard: the scene's.
        table: which rows.
        splits: that the scene belongs to.
        path: the file.

    Raises:
        ShardError: the shard is damaged.
        OSError: the disk refuses.
    """
    with tarfile.open(path, "w", format=tarfile.PAX_FORMAT) as tar:
        for group in groups_of(shard, table):
            columns = columns_of(shard, group)
            for row in rows_of(shard, group, columns):
                for name, data in _files(row, columns, splits):
                    member = tarfile.TarInfo(f"{_key(row)}.{name}")
                    member.size = len(data)
                    tar.addfile(member, io.BytesIO(data))


def _key(row: Row) -> str:
    """The sample's name, without the dots that would end it."""
    return f"{row.scene}-{row.group}-{row.frame:06d}".replace(".", "_")


def _files(row: Row, columns: Sequence[Column], splits: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    """Suffix and content of a sample's files."""
    small: dict[str, Any] = {
        "scene": row.scene,
        "group": row.group,
        "frame": row.frame,
        "splits": list(splits),
    }
    for column in columns:
        value, suffix = row.values[column.name], column.name.replace("/", ".")
        if column.form == "image":
            data = value.tobytes()
            yield ("png" if data.startswith(PNG_START) else "jpg"), data
        elif column.form == "picture":
            yield f"{suffix}.png", png_of(value)
        elif column.form == "array":
            yield f"{suffix}.npy", _npy(value)
        else:
            small[column.name] = spelled(plain(value))
    yield "json", json.dumps(small, allow_nan=False).encode()


def spelled(value: Any) -> Any:  # noqa: ANN401  # plain values
    """JSON's own values: NaN is null, infinity a text; `numpy.array(value, dtype=float)` restores both."""
    if isinstance(value, list):
        return [spelled(one) for one in value]
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) else str(value)


def _npy(array: Any) -> bytes:  # noqa: ANN401  # arrays of several dtypes
    file = io.BytesIO()
    np.save(file, np.ascontiguousarray(array), allow_pickle=False)
    return file.getvalue()
