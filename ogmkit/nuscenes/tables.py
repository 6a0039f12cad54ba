"""JSON tables read by DuckDB into memory: only the columns and rows that are needed, within a memory cap."""

import glob
import os
import tempfile
import uuid
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import duckdb
import numpy as np
from numpy.typing import NDArray

from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.array_file import REMEDY, require_array
from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.schema import Column, columns

Parameters = Sequence[object] | Mapping[str, object]
"""Of a statement: for `?` in order, or for `$name`."""

_MAX_THREADS = 4
_UNREADABLE = (duckdb.Error, UnicodeDecodeError)  # the latter where DuckDB quotes bytes that are no UTF-8
_BATCH = 4096
_LARGEST_OBJECT = "maximum_object_size = 16777216"

# Frame records need key frames of cameras and LiDAR only. NULLs and dangling tokens stay in: rules name them.
_JOINS = {
    "sample_data": """
        ANTI JOIN (
            SELECT c.token FROM calibrated_sensor c JOIN sensor s ON s.token = c.sensor_token
            WHERE s.modality = 'radar'
        ) radar ON radar.token = t.calibrated_sensor_token
        WHERE t.is_key_frame IS NOT FALSE""",
    "ego_pose": "SEMI JOIN sample_data ON sample_data.ego_pose_token = t.token",
    "sample_annotation": """
        LEFT JOIN (
            SELECT s.token, min(c.rowid) AS scene_row FROM sample s JOIN scene c ON c.token = s.scene_token
            GROUP BY s.token
        ) place ON place.token = t.sample_token""",
}
# Small ones, read value by value from the start: DuckDB would take an object where a name should be for text.
_NAMING = frozenset({"log", "map", "scene", "sensor", "category"})
# A number finds a scene's annotations among a million several times faster than 40 tokens do.
_ADDED_COLUMNS = {"sample_annotation": ", place.scene_row"}


class Tables:
    """Tables of one version folder in an in-memory DuckDB that spills to a temporary folder.

    Args:
        folder: holds the JSON files.
        complete: keep all columns and rows, as `ogmkit check` needs; else what frame records are made from.
        memory_limit: DuckDB's cap, such as `1GB`.
    """

    def __init__(self, folder: Path, *, complete: bool = False, memory_limit: str = "1GB") -> None:
        self.folder = folder
        self.complete = complete
        # DuckDB makes this folder when it first spills and removes it on closing.
        spill = Path(tempfile.gettempdir()) / f"ogmkit-tables-{uuid.uuid4().hex}"
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="ogmkit-tables")
        self._connection = duckdb.connect(
            ":memory:",
            config={
                "memory_limit": memory_limit,
                "threads": str(min(_MAX_THREADS, os.cpu_count() or 1)),
                "temp_directory": str(spill),
                "autoinstall_known_extensions": "false",
            },
        )

    def __enter__(self) -> "Tables":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the memory and the temporary folder; no query works afterwards."""
        self._thread.shutdown()
        self._connection.close()

    def path(self, table: str) -> Path:
        """A table's JSON file."""
        return self.folder / f"{table}.json"

    def load(self, table: str) -> None:
        """Read one table; values of the wrong type become NULL, which the rules report by record.

        Raises:
            TableError: the file is absent, or no JSON array of records.
        """
        require_array(self.path(table))
        with self._reading(table):
            try:
                self._create(table, strict=table in _NAMING)
            except _UNREADABLE:
                # One value of a wrong type ends the quick way; the slow one looks at each value's own type.
                self._create(table, strict=True)

    def load_empty(self, table: str) -> None:
        """Put a table without rows in the place of one that can't be read."""
        listed = ", ".join(
            f"{column.name} {column.type}" for column in columns(table, complete=self.complete)
        )
        self.execute(f"CREATE OR REPLACE TABLE {table} ({listed})")

    def execute(self, sql: str, parameters: Parameters = ()) -> None:
        """Run a statement that gives nothing back."""
        self._run(self._connection, sql, parameters)

    def rows(self, sql: str, parameters: Parameters = ()) -> list[tuple[Any, ...]]:
        """A query's rows."""
        return self._run(self._connection, sql, parameters).fetchall()

    def stream(self, sql: str, parameters: Parameters = ()) -> Iterator[tuple[Any, ...]]:
        """A query's rows, a few thousand in memory at a time; other queries may run meanwhile."""
        result = self._run(self._connection.cursor(), sql, parameters)
        while batch := result.fetchmany(_BATCH):
            yield from batch

    def arrays(self, sql: str, parameters: Parameters = ()) -> dict[str, NDArray[Any]]:
        """A query's columns; vectors come as objects, see `stacked`."""
        result: dict[str, NDArray[Any]] = self._run(self._connection, sql, parameters).fetchnumpy()
        return result

    def raw(self, table: str, column: str, token: str) -> list[str | None]:
        """What stands in a column of the records with a token, as JSON text; None where nothing does."""
        source = _read_json({"token": "JSON", column: "JSON"})
        query = f"SELECT {column} FROM {source} WHERE token ->> '$' = ?"
        with self._reading(table):
            return [value for (value,) in self.rows(query, [self._file(table), token])]

    def objects(self, table: str) -> Iterator[str]:
        """The records of a table as they stand in its file, as JSON text, in order."""
        sql = f"SELECT json FROM read_json_objects(?, format = 'array', {_LARGEST_OBJECT})"
        with self._reading(table):
            for (text,) in self.stream(sql, [self._file(table)]):
                yield text

    @contextmanager
    def _reading(self, table: str) -> Iterator[None]:
        """Name the file of which DuckDB says that it can't be read, or is no JSON."""
        path = self.path(table)
        try:
            yield
        except (duckdb.OutOfMemoryException, duckdb.IOException) as error:
            raise TableError(
                f"{path}: {_reason(error)}; free memory or space in {tempfile.gettempdir()}"
            ) from error
        except _UNREADABLE as error:
            raise TableError(f"{path}: no sound JSON ({_reason(error)}); {REMEDY}") from error

    def _file(self, table: str) -> str:
        return glob.escape(str(self.path(table).resolve()))

    def _run(
        self, connection: duckdb.DuckDBPyConnection, sql: str, parameters: Parameters
    ) -> duckdb.DuckDBPyConnection:
        """Run a statement in a thread: Ctrl-C ends it at once, while DuckDB alone heeds it afterwards."""
        _require_utf8(parameters)
        running = self._thread.submit(connection.execute, sql, parameters)
        try:
            return running.result()
        except KeyboardInterrupt:
            connection.interrupt()
            raise

    def _create(self, table: str, *, strict: bool) -> None:
        chosen = columns(table, complete=self.complete)
        names = ", ".join(f"t.{column.name}" for column in chosen)
        added, joined = ("", "") if self.complete else (_ADDED_COLUMNS.get(table, ""), _JOINS.get(table, ""))
        source = _strict_source(chosen) if strict else _source(chosen)
        # Without cardinalities the optimizer hashes millions of poses rather than the few tokens looked for.
        self.execute("SET disabled_optimizers = 'join_order,build_side_probe_side'")
        self.execute(
            f"CREATE OR REPLACE TABLE {table} AS SELECT {names}{added} FROM {source} t {joined}",
            [self._file(table)],
        )
        self.execute("RESET disabled_optimizers")


def stacked(vectors: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """A column of N equally shaped vectors as one (N, *shape) float64 array."""
    return np.array([np.stack(v) if len(shape) > 1 else v for v in vectors], dtype=np.float64).reshape(
        -1, *shape
    )


def _source(chosen: Sequence[Column]) -> str:
    return _read_json({column.name: column.type for column in chosen})


def _strict_source(chosen: Sequence[Column]) -> str:
    """Each value as it stands in the file, NULL unless it is of the column's type."""
    casts = ", ".join(f"{_strict_cast(column)} AS {column.name}" for column in chosen)
    return f"(SELECT {casts} FROM {_read_json({column.name: 'JSON' for column in chosen})})"


def _strict_cast(column: Column) -> str:
    name = column.name
    if column.type == "VARCHAR":
        return f"CASE WHEN json_type({name}) = 'VARCHAR' THEN {name} ->> '$' END"
    if column.type == "BIGINT":
        return f"CASE WHEN json_type({name}) IN ('BIGINT', 'UBIGINT') THEN TRY_CAST({name} AS BIGINT) END"
    return f"TRY_CAST({name} AS {column.type})"


def _read_json(types: dict[str, str]) -> str:
    listed = ", ".join(f"{name}: '{type_}'" for name, type_ in types.items())
    return (
        f"read_json(?, format = 'array', columns = {{{listed}}}, "
        f"hive_partitioning = false, {_LARGEST_OBJECT})"
    )


def _reason(error: Exception) -> str:
    """DuckDB's first line, without the file's name, which stands before it anyway."""
    return one_line(str(error).splitlines()[0].split('.json", ')[-1])


def _require_utf8(parameters: Parameters) -> None:
    """Refuse texts that no table can hold, such as names of files in another encoding."""
    for one in parameters.values() if isinstance(parameters, Mapping) else parameters:
        for text in one if isinstance(one, list | tuple) else [one]:
            try:
                str(text).encode()
            except UnicodeEncodeError as error:
                raise SettingsError(f"{text!r}: is not valid UTF-8; rename it, or choose another") from error
