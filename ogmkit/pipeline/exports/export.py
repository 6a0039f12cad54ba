"""A folder of shards in another layout: resumable, interruptible, each file whole or absent."""

import time
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Literal

from ogmkit.base import locks
from ogmkit.base.atomic import output_errors, replacing, require_outside
from ogmkit.base.execution import DEFAULT_EXECUTION, Execution, run_over
from ogmkit.base.extras import require_packages
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import ShardError
from ogmkit.pipeline.exports import parquet, record, webdataset
from ogmkit.pipeline.exports.card import write_card
from ogmkit.pipeline.exports.columns import TABLES, Column, Table, columns_of, groups_of
from ogmkit.pipeline.exports.record import ExportedFile, ExportSummary
from ogmkit.pipeline.output import require_no_other_run
from ogmkit.shards.faults import AGAIN
from ogmkit.shards.listed import listed_shard, require_unchanged
from ogmkit.shards.manifest import NAME as MANIFEST
from ogmkit.shards.manifest import Manifest, ShardEntry, file_sha256, read_manifest
from ogmkit.shards.reader import Shard

ExportFormat = Literal["webdataset", "parquet", "hf"]
FORMATS: tuple[ExportFormat, ...] = ("webdataset", "parquet", "hf")


@dataclass(frozen=True)
class _Task:
    """One scene's work.

    Attributes:
        shards: the folder of shards.
        out: the folder of the export.
        entry: of the manifest.
        form: the layout.
        columns: table → columns of all scenes.
        known: files of an export that was finished; else empty.
    """

    shards: Path
    out: Path
    entry: ShardEntry
    form: ExportFormat
    columns: Mapping[Table, Mapping[str, Column]]
    known: Mapping[str, ExportedFile]

    def file(self, table: Table) -> str:
        """Of the scene's rows."""
        suffix = webdataset.SUFFIX if self.form == "webdataset" else parquet.SUFFIX
        return f"{table}/{self.entry.scene}{suffix}"


def export_shards(
    shards: Path, out: Path, form: ExportFormat, *, execution: Execution = DEFAULT_EXECUTION
) -> ExportSummary:
    """Write a folder's shards in another layout, a file a scene and table; `export.json` lists them.

    Rows are written as they are read: a worker holds a few frames. Killed at any moment, the same call again
    finishes the work.

    Args:
        shards: a folder that an extraction finished.
        out: the folder to write; outside the shards'.
        form: `webdataset`, `parquet`, or `hf`: Parquet with a card that `datasets.load_dataset` reads.
        execution: worker processes and progress.

    Raises:
        MissingPackageError: Parquet needs the extra `parquet`.
        ShardError: the folder is not a finished extraction, or a shard is absent, damaged or changed.
        OutputError: OUT holds something else or another export, another command writes there, or the disk
            refuses.
        OgmkitError: a worker process died.
    """
    started = time.monotonic()
    if form != "webdataset":
        require_packages("parquet", ("pyarrow",))
    manifest = _manifest(shards)
    require_outside(out, shards)
    configuration = {"layout": form, "manifest_sha256": file_sha256(shards / MANIFEST)}
    files: list[ExportedFile] = []
    kept = 0
    with locks.locked(out, record.LOCK):
        known, columns = record.begin(out, configuration), _columns(shards, manifest)
        tasks = [_Task(shards, out, entry, form, columns, known) for entry in manifest.shards]
        tell(Found(f"{with_number(len(tasks), 'scene')}; {execution.place}"))
        with closing(run_over(_run, tasks, execution)) as results:
            for done, (made, there) in enumerate(results, start=1):
                files += made
                kept += there
                execution.report(done, len(tasks))
        files.sort(key=attrgetter("file"))
        if form == "hf":
            write_card(out, files)
        record.finish(out, configuration, files)
    return ExportSummary(tuple(files), kept, time.monotonic() - started)


def _manifest(shards: Path) -> Manifest:
    """The manifest of a folder whose shards nothing is adding to."""
    manifest = read_manifest(shards)
    if not manifest.shards:
        raise ShardError(f"{shards}: the manifest names no shard; {AGAIN}")
    require_no_other_run(shards, "export-shards")
    return manifest


def _columns(shards: Path, manifest: Manifest) -> dict[Table, dict[str, Column]]:
    """Table → columns of all scenes by name: Parquet's are the same in all files."""
    found: dict[Table, dict[str, Column]] = {}
    for entry in manifest.shards:
        with listed_shard(shards, entry) as shard:
            for table in TABLES:
                for group in groups_of(shard, table):
                    names = {column.name: column for column in columns_of(shard, group)}
                    found[table] = found.get(table, {}) | names
    return {table: dict(sorted(columns.items())) for table, columns in found.items()}


def _run(task: _Task) -> tuple[tuple[ExportedFile, ...], int]:
    """Write a scene's files, or find that they are there: the files, and how many were; runs in a worker."""
    source = task.shards / task.entry.file
    require_unchanged(source, task.entry)  # else damage would get a valid checksum
    files, kept = [], 0
    with Shard(source) as shard:
        for table in task.columns:
            rows = sum(map(shard.frames, groups_of(shard, table)))
            name = task.file(table)
            there = record.is_whole(task.out / name, task.known.get(name))
            if not there:
                _write(task, table, shard)
            files.append(_recorded(task, table, rows))
            kept += there
    return tuple(files), kept


def _write(task: _Task, table: Table, shard: Shard) -> None:
    path = task.out / task.file(table)
    with output_errors(path.parent):
        path.parent.mkdir(exist_ok=True)
    with replacing(path) as part:
        if task.form == "webdataset":
            webdataset.write_tar(shard, table, task.entry.splits, part)
        else:
            parquet.write_parquet(shard, table, task.entry.splits, part, task.columns[table])


def _recorded(task: _Task, table: Table, rows: int) -> ExportedFile:
    path, entry = task.out / task.file(table), task.entry
    size, checksum = path.stat().st_size, file_sha256(path)
    return ExportedFile(task.file(table), table, entry.scene, entry.splits, rows, size, checksum)
