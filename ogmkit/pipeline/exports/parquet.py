"""Parquet files: a row a frame, one column a dataset, pictures as PNG or JPEG files.

These are structs of `bytes` and an empty `path`, which Hugging Face's `datasets` decodes as images.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from ogmkit.pipeline.exports.columns import Column, Row, Table, groups_of, plain, rows_of
from ogmkit.pipeline.exports.pictures import png_of
from ogmkit.shards.reader import Shard

SUFFIX = ".parquet"
_PICTURED = ("image", "picture")
_ROWS_AT_A_TIME = 16
"""Rows of a group in the file, which are held in memory at once."""
_PLACE = {"scene": ("string", 0), "group": ("string", 0), "frame": ("int64", 0), "splits": ("string", 1)}
"""Columns that say where a row is from: kind of their values, and dimensions."""


def write_parquet(
    shard: Shard, table: Table, splits: Sequence[str], path: Path, columns: Mapping[str, Column]
) -> None:
    """Write a scene's rows, a few at a time.

    Args:
        shard: the scene's.
        table: which rows.
        splits: that the scene belongs to.
        path: the file.
        columns: of the table in all scenes; where a scene lacks one, it is null.

    Raises:
        ShardError: the shard is damaged.
        OSError: the disk refuses.
    """
    import pyarrow as pa  # noqa: PLC0415  # comes with the extra `parquet`
    from pyarrow import parquet  # noqa: PLC0415

    schema = _schema(columns)
    with parquet.ParquetWriter(path, schema) as writer:
        for records in _batches(_records(shard, table, splits, columns)):
            writer.write_table(pa.Table.from_pylist(records, schema=schema))


def _records(
    shard: Shard, table: Table, splits: Sequence[str], columns: Mapping[str, Column]
) -> Iterator[dict[str, Any]]:
    for group in groups_of(shard, table):
        here = tuple(column for name, column in columns.items() if name in shard.h5[group])
        for row in rows_of(shard, group, here):
            yield _record(row, here, splits)


def _record(row: Row, columns: Sequence[Column], splits: Sequence[str]) -> dict[str, Any]:
    place = {"scene": row.scene, "group": row.group, "frame": row.frame, "splits": list(splits)}
    return place | {column.name: _value(column, row.values[column.name]) for column in columns}


def _value(column: Column, value: Any) -> Any:  # noqa: ANN401  # as the column's form says
    if column.form in _PICTURED:
        return {"bytes": value.tobytes() if column.form == "image" else png_of(value)}
    return plain(value)


def _batches(records: Iterable[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    left = iter(records)
    while batch := list(islice(left, _ROWS_AT_A_TIME)):
        yield batch


def _schema(columns: Mapping[str, Column]) -> Any:  # noqa: ANN401  # pyarrow's, which may be absent
    """Types of all columns, and the features that Hugging Face's `datasets` takes them for."""
    import pyarrow as pa  # noqa: PLC0415  # comes with the extra `parquet`

    types = {name: _type(*kind) for name, kind in _PLACE.items()}
    features = {name: _feature(*kind) for name, kind in _PLACE.items()}
    for name, column in columns.items():
        kind = "string" if column.field.dtype == "text" else column.field.dtype
        if column.form in _PICTURED:
            types[name] = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
            features[name] = {"_type": "Image"}
        else:
            types[name] = _type(kind, column.dimensions)
            features[name] = _feature(kind, column.dimensions)
    metadata = {"huggingface": json.dumps({"info": {"features": features}})}
    return pa.schema(list(types.items()), metadata=metadata)


def _type(kind: str, dimensions: int) -> Any:  # noqa: ANN401  # pyarrow's
    """Lists of lists of numbers or texts."""
    import pyarrow as pa  # noqa: PLC0415  # comes with the extra `parquet`

    found = pa.type_for_alias(kind)
    for _ in range(dimensions):
        found = pa.list_(found)
    return found


def _feature(kind: str, dimensions: int) -> dict[str, Any]:
    """The same for `datasets`."""
    found: dict[str, Any] = {"dtype": kind, "_type": "Value"}
    for _ in range(dimensions):
        found = {"feature": found, "_type": "Sequence"}
    return found
