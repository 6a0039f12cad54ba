"""`ogmkit check --fix`: tables with their unambiguous faults corrected, in a new folder beside the old one.

What is corrected follows from other records: links from times, counts from what is counted, paths from their
separators. Where it doesn't, as with two key frames of one time, the records stay as they are.
"""

import codecs
import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from ogmkit.base.atomic import output_errors
from ogmkit.base.files import open_file
from ogmkit.errors import OutputError, TableError
from ogmkit.nuscenes.paths import UNSAFE_NAME
from ogmkit.nuscenes.schema import TABLES
from ogmkit.nuscenes.tables import Tables
from ogmkit.nuscenes.versions import find_version

_COPIED_BYTES = 1 << 20


@dataclass(frozen=True)
class Fixed:
    """What was corrected.

    Attributes:
        table: the table's name.
        column: which column; empty for the file's form.
        count: in how many records; 1 for a file.
    """

    table: str
    column: str
    count: int


def _chain(group: str, rows: str) -> tuple[str, ...]:
    """SQL giving (row, column, value) for wrong `prev` and `next` of the groups whose times are all distinct.

    Args:
        group: SQL of what a chain has in common.
        rows: SQL of the table `t` with what gives `time_us`.
    """
    ordered = f"""
        SELECT t.rowid AS row, t.prev, t.next, {group} AS chain, time_us,
            coalesce(lag(t.token) OVER steps, '') AS before, coalesce(lead(t.token) OVER steps, '') AS after
        FROM {rows} WINDOW steps AS (PARTITION BY {group} ORDER BY time_us)
    """
    sound = f"""
        SELECT chain FROM ({ordered}) GROUP BY chain
        HAVING count(DISTINCT time_us) = count(*) AND bool_or(prev IS DISTINCT FROM before
            OR next IS DISTINCT FROM after)
    """
    return tuple(
        f"SELECT row, '{column}' AS key, {value} AS value FROM ({ordered}) "
        f"SEMI JOIN ({sound}) s USING (chain) WHERE {column} IS DISTINCT FROM {value}"
        for column, value in (("prev", "before"), ("next", "after"))
    )


def _ends(table: str, group: str, rows: str, columns: tuple[str, str, str]) -> tuple[str, ...]:
    """SQL giving (row, column, value) for wrong counts, first and last tokens of a record's parts."""
    parts = f"""
        SELECT {group} AS owner, count(*)::VARCHAR AS count, min_by(t.token, time_us) AS first,
            max_by(t.token, time_us) AS last FROM {rows} GROUP BY 1
        HAVING count(DISTINCT time_us) = count(*)
    """
    return tuple(
        f"SELECT o.rowid AS row, '{column}' AS key, p.{value} AS value FROM {table} o JOIN ({parts}) p "
        f"ON p.owner = o.token WHERE o.{column}::VARCHAR IS DISTINCT FROM p.{value}"
        for column, value in zip(columns, ("count", "first", "last"), strict=True)
    )


_SAMPLES = "(SELECT rowid, *, timestamp AS time_us FROM sample WHERE timestamp IS NOT NULL) t"
_SENSOR_DATA = (
    "(SELECT d.rowid, d.*, s.scene_token, d.timestamp AS time_us FROM sample_data d "
    "JOIN sample s ON s.token = d.sample_token WHERE d.timestamp IS NOT NULL) t"
)
_ANNOTATIONS = (
    "(SELECT a.rowid, a.*, s.timestamp AS time_us FROM sample_annotation a "
    "JOIN sample s ON s.token = a.sample_token WHERE s.timestamp IS NOT NULL) t"
)


def _slashes(table: str) -> tuple[str, ...]:
    return (
        f"SELECT rowid AS row, 'filename' AS key, replace(filename, '\\', '/') AS value FROM {table} "
        "WHERE contains(filename, '\\')",
    )


_FIXES: dict[str, tuple[str, ...]] = {
    "map": _slashes("map"),
    "scene": _ends(
        "scene", "t.scene_token", _SAMPLES, ("nbr_samples", "first_sample_token", "last_sample_token")
    ),
    "sample": _chain("t.scene_token", _SAMPLES),
    "sample_data": (
        *_slashes("sample_data"),
        *_chain("(t.scene_token, t.calibrated_sensor_token)", _SENSOR_DATA),
    ),
    "instance": _ends(
        "instance",
        "t.instance_token",
        _ANNOTATIONS,
        ("nbr_annotations", "first_annotation_token", "last_annotation_token"),
    ),
    "sample_annotation": _chain("t.instance_token", _ANNOTATIONS),
}
"""Table → SQL giving (row, column, corrected value as text)."""
_WHOLE_NUMBERS = ("nbr_samples", "nbr_annotations")


def fix_tables(dataset_root: Path, version: str | None, name: str) -> tuple[Fixed, ...]:
    """Write a dataset's tables, corrected, to a new folder; the folder appears when it is whole.

    Args:
        dataset_root: holds the version folder.
        version: the version folder's name; None where there is only one `v1.0-*`.
        name: of the new folder in the root.

    Returns:
        What was corrected; nothing, and no folder is made, where there was nothing to correct.

    Raises:
        TableError: a table is absent or can't be read.
        SettingsError: the version is absent, or several are there and none was asked for.
        OutputError: the new folder exists, has an unsuitable name or can't be written.
    """
    folder = dataset_root / find_version(dataset_root, version)
    out = dataset_root / name
    if re.search(UNSAFE_NAME, name):
        raise OutputError(f"{name!r} is not a valid folder name; choose another")
    if out.exists():
        raise OutputError(f"{out}: exists; name a new folder")
    part = dataset_root / f".{name}.part"
    try:
        with output_errors(out):
            shutil.rmtree(part, ignore_errors=True)
            part.mkdir()
            fixed = (*_copy(folder, part), *_correct(part))
            if fixed:
                part.rename(out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return fixed


def _copy(folder: Path, part: Path) -> Iterator[Fixed]:
    """Copy all tables, without byte-order marks."""
    for path in sorted(folder.glob("*.json")):
        with (part / path.name).open("wb") as copy:
            for number, data in enumerate(_chunks(path)):
                marked = number == 0 and data.startswith(codecs.BOM_UTF8)
                if marked:
                    yield Fixed(path.stem, "", 1)
                copy.write(data.removeprefix(codecs.BOM_UTF8) if marked else data)


def _chunks(path: Path) -> Iterator[bytes]:
    try:
        with open_file(path) as file:
            while data := file.read(_COPIED_BYTES):
                yield data
    except OSError as error:
        raise TableError(f"{path}: cannot be read ({error.strerror}); check the file") from error


def _correct(part: Path) -> Iterator[Fixed]:
    with Tables(part, complete=True) as tables:
        for table in TABLES:
            tables.load(table)
        for table, queries in _FIXES.items():
            tables.execute(f"CREATE OR REPLACE TABLE fix AS {' UNION ALL '.join(queries)}")
            counts = tables.rows("SELECT key, count(*) FROM fix GROUP BY key ORDER BY key")
            if counts:
                _rewrite(tables, table, part / f"{table}.json")
            yield from (Fixed(table, column, count) for column, count in counts)


def _rewrite(tables: Tables, table: str, path: Path) -> None:
    """Replace a table's file; its records stay in order, and what is not corrected stays as it is."""
    changes = groupby(tables.stream("SELECT row, key, value FROM fix ORDER BY row"), key=lambda fix: fix[0])
    coming = next(changes, None)
    new = path.with_suffix(".new")
    with new.open("w", encoding="utf-8") as file:
        for row, text in enumerate(tables.objects(table)):
            file.write("[\n" if row == 0 else ",\n")
            if coming is not None and coming[0] == row:
                values = {key: _value(key, value) for _, key, value in coming[1]}
                file.write(json.dumps(json.loads(text) | values, ensure_ascii=False))
                coming = next(changes, None)
            else:
                file.write(text)
        file.write("\n]\n")
    new.replace(path)


def _value(key: str, text: str) -> Any:  # noqa: ANN401  # text or a number
    return int(text) if key in _WHOLE_NUMBERS else text
