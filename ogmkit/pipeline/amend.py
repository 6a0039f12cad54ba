"""Adding groups to the shards of a finished folder: resumable, interruptible, each shard old or new."""

import logging
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution, run_over
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, Waiting, tell
from ogmkit.errors import ShardError
from ogmkit.pipeline import output
from ogmkit.pipeline.amendment import Amendment, Groups, chosen_cameras, pending_groups, require_sound
from ogmkit.shards.additions import add_to_shard, new_group, place
from ogmkit.shards.faults import AGAIN
from ogmkit.shards.listed import require_unchanged
from ogmkit.shards.manifest import LOCK, Manifest, ShardEntry, file_sha256, read_manifest, write_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import ShardFile

Report = TypeVar("Report")

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Amended(Generic[Report]):
    """One shard.

    Attributes:
        scene: the scene's name.
        changed: whether anything was added; otherwise all of it was there.
        report: the amendment's.
    """

    scene: str
    changed: bool
    report: Report


@dataclass(frozen=True)
class _Task(Generic[Report]):
    """One shard's work.

    Attributes:
        path: the shard's file.
        entry: of the manifest.
        settled: whether the manifest knows the file; not after a run that was cut short.
        pending: camera → groups to make; empty where all are there.
        cameras: chosen ones.
        frames: over these cameras.
        amendment: the command's.
    """

    path: Path
    entry: ShardEntry
    settled: bool
    pending: dict[str, Groups]
    cameras: tuple[str, ...]
    frames: int
    amendment: Amendment[Report]


def amend(
    out: Path,
    amendment: Amendment[Report],
    *,
    cameras: Sequence[str] = (),
    execution: Execution = DEFAULT_EXECUTION,
    where: str = "",
) -> tuple[Amended[Report], ...]:
    """Add groups to all shards of a folder, then bring its manifest up to date.

    All shards are looked at before the first is changed. Existing groups with the same attributes stay.
    Killed at any moment, the same call again finishes the work.

    Args:
        out: a folder that an extraction finished.
        amendment: what to add.
        cameras: channels; none means all.
        execution: worker processes, progress, and whether to rebuild what exists.
        where: the work is done, in words; by default what `execution` says.

    Returns:
        One result a shard, in the manifest's order.

    Raises:
        ShardError: the folder is not a finished extraction, or a shard is absent, damaged or changed.
        SettingsError: there is no such camera, or the amendment can't be made.
        OutputError: groups with other settings exist, another command writes or was cut short here, or
            the disk refuses.
        OgmkitError: a worker process died, or the scheduler is gone.
    """
    read_manifest(out)  # in a folder that isn't ours, not even a lock is made
    execution.require_reachable()
    done: dict[str, tuple[ShardEntry, Amended[Report]]] = {}
    with output.locked(out):
        manifest = read_manifest(out)
        settled = output.require_no_other_run(out, amendment.command)
        tasks = _tasks(out, manifest, amendment, cameras, settled=settled, overwrite=execution.overwrite)
        if any(task.pending for task in tasks):
            output.begin_amending(out, amendment.command)
        tell(Found(f"{_found(tasks)}; {where or execution.place}"))
        with closing(run_over(_run, tasks, execution, shared=(out / LOCK,))) as results:
            for entry, amended in results:
                done[entry.file] = entry, amended
                _LOG.debug("%s: %s", entry.scene, "written" if amended.changed else "kept")
                execution.report(len(done), len(tasks))
        ordered = [done[entry.file] for entry in manifest.shards]
        _finish(out, manifest, tuple(entry for entry, _ in ordered))
    return tuple(amended for _, amended in ordered)


def _tasks(
    out: Path,
    manifest: Manifest,
    amendment: Amendment[Report],
    cameras: Sequence[str],
    *,
    settled: bool,
    overwrite: bool,
) -> list[_Task[Report]]:
    chosen = chosen_cameras(out, manifest, cameras)
    if not manifest.shards:
        raise ShardError(f"{out}: the manifest names no shard; {AGAIN}")
    tasks = []
    if settled:
        tell(Waiting(f"comparing checksums of {with_number(len(manifest.shards), 'shard')}"))
    for entry in manifest.shards:
        path = out / entry.file
        if settled:
            require_unchanged(path, entry)  # else damage would get a valid checksum
        with Shard(path) as shard:
            require_sound(shard, entry, manifest)
            pending = pending_groups(shard, amendment, chosen, overwrite=overwrite)
            frames = sum(map(shard.frames, chosen))
        tasks.append(_Task(path, entry, settled, pending, chosen, frames, amendment))
    return tasks


def _found(tasks: Sequence[_Task[Report]]) -> str:
    """What there is to do, in words."""
    scenes, frames = (
        with_number(len(tasks), "scene"),
        with_number(sum(task.frames for task in tasks), "frame"),
    )
    there = sum(not task.pending for task in tasks)
    done = f"; {with_number(there, 'scene')} already complete" if there else ""
    return f"{scenes}, {frames} of {', '.join(tasks[0].cameras)}{done}"


def _run(task: _Task[Report]) -> tuple[ShardEntry, Amended[Report]]:
    """Add to one shard, or find that nothing is to be added; runs in a worker."""
    path, entry = task.path, task.entry
    if task.pending:
        with Shard(path) as shard:
            add_to_shard(path, lambda file: _add(task, shard, file), replaced=_places(task))
    if task.pending or not task.settled:
        entry = replace(entry, bytes=path.stat().st_size, sha256=file_sha256(path))
    with Shard(path) as shard:
        report = task.amendment.report(shard, task.cameras)
    return entry, Amended(entry.scene, bool(task.pending), report)


def _add(task: _Task[Report], shard: Shard, file: ShardFile) -> None:
    for camera, groups in task.pending.items():
        with file.writing() as h5:
            for name, values in groups.items():
                new_group(h5, camera, task.amendment.kind, name, values)
        task.amendment.write(shard, camera, tuple(groups), file)


def _places(task: _Task[Report]) -> set[str]:
    kind = task.amendment.kind
    return {place(camera, kind, name) for camera, groups in task.pending.items() for name in groups}


def _finish(out: Path, manifest: Manifest, entries: tuple[ShardEntry, ...]) -> None:
    if entries != manifest.shards:
        write_manifest(out, replace(manifest, shards=entries))
    output.finish_amending(out)
