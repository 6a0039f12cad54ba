"""Checking a folder of shards: files, checksums, schema, and whether values agree with each other."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ogmkit.base.differences import differences
from ogmkit.base.execution import DEFAULT_EXECUTION, Execution, run_in_order
from ogmkit.base.parts import is_part
from ogmkit.errors import ShardError
from ogmkit.shards.crosschecks import cross_problems
from ogmkit.shards.crosschecks_added import added_problems
from ogmkit.shards.crosschecks_further import further_problems
from ogmkit.shards.crosschecks_labels import label_contradictions
from ogmkit.shards.crosschecks_seen import seen_problems
from ogmkit.shards.faults import AGAIN, H5_ERRORS, REMEDY, damaged
from ogmkit.shards.listed import require_unchanged
from ogmkit.shards.manifest import (
    AMENDING,
    LOCK,
    MARKER,
    NAME,
    Manifest,
    ShardEntry,
    read_manifest,
    unfinished_command,
)
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.structure import structure_problems


@dataclass(frozen=True)
class Problem:
    """Something wrong with a folder.

    Attributes:
        file: name in the folder.
        message: what is wrong, in one line.
    """

    file: str
    message: str


@dataclass(frozen=True)
class _Task:
    """A shard to be checked.

    Attributes:
        path: its file.
        entry: the manifest's; None where that doesn't name it.
        stored: the configuration of all shards by the manifest; None where that can't be read.
        settled: whether the manifest knows the file; not after a run that was cut short.
    """

    path: Path
    entry: ShardEntry | None
    stored: Mapping[str, Any] | None
    settled: bool


def verify_folder(out: Path, *, execution: Execution = DEFAULT_EXECUTION) -> tuple[Problem, ...]:
    """Check a folder that an extraction finished; reads all of it, a frame at a time.

    Args:
        out: the folder.
        execution: where the shards are checked; progress counts them.

    Returns:
        All problems found; none means that the folder is sound.

    Raises:
        ShardError: `out` is not a folder, or holds no shards at all.
        OgmkitError: a worker process died, or the scheduler is gone.
    """
    try:
        present = {path.name for path in out.iterdir()}
    except OSError as error:
        raise ShardError(
            f"{out}: can't be read ({error.strerror}); choose a folder of `ogmkit extract`"
        ) from error
    names = sorted(name for name in present if name.endswith(".h5") and not name.startswith("."))
    if not names and NAME not in present:
        raise ShardError(f"{out}: holds no shards; choose a folder that `ogmkit extract` wrote")
    manifest, problems = _manifest(out)
    if MARKER in present:
        problems.append(Problem(MARKER, "the extraction is unfinished; run `ogmkit extract` again"))
    unfinished = _unfinished(out)
    problems += unfinished
    entries = {} if manifest is None else {entry.file: entry for entry in manifest.shards}
    listed = entries.keys() if manifest is not None else set(names)
    problems += [Problem(name, f"is missing; {AGAIN}") for name in sorted(listed - present)]
    problems += _extra(present - listed - {NAME}, present & {MARKER, AMENDING})
    stored = None if manifest is None else _configuration(manifest.dataset_version, manifest.settings)
    tasks = (_Task(out / name, entries.get(name), stored, not unfinished) for name in names)
    shared = (out / NAME,) if NAME in present else (out,)
    with closing(run_in_order(_check, tasks, execution, shared=shared)) as checked:
        for done, found in enumerate(checked, start=1):
            problems += found
            execution.report(done, len(names))
    return tuple(problems)


def _configuration(dataset_version: str, settings: ExtractSettings) -> dict[str, Any]:
    return {"dataset_version": dataset_version, **settings.to_dict()}


def _extra(names: set[str], marks: set[str]) -> Iterator[Problem]:
    """Of files that the manifest doesn't name; what an unfinished run left will go with its mark."""
    for name in sorted(names - marks):
        if name != LOCK and not is_part(Path(name)):
            yield Problem(name, "is not in the manifest; move it elsewhere")
        elif not marks:
            yield Problem(name, "was left by a run that was killed; remove it")


def _manifest(out: Path) -> tuple[Manifest | None, list[Problem]]:
    try:
        return read_manifest(out), []
    except ShardError as error:
        return None, [Problem(NAME, _without_path(error, out / NAME))]


def _unfinished(out: Path) -> list[Problem]:
    """Of a run that adds to shards: until it is finished, the manifest may not know them."""
    try:
        command = unfinished_command(out)
    except ShardError as error:
        return [Problem(AMENDING, _without_path(error, out / AMENDING))]
    return (
        []
        if command is None
        else [Problem(AMENDING, f"{command} is unfinished; run `ogmkit {command}` again")]
    )


def _check(task: _Task) -> tuple[Problem, ...]:
    """Check one shard; runs in a worker."""
    return tuple(Problem(task.path.name, message) for message in _shard_problems(task))


def _shard_problems(task: _Task) -> Iterator[str]:
    path = task.path
    try:
        if task.entry is not None and task.settled:
            require_unchanged(path, task.entry)  # what doesn't match is never opened
        with Shard(path) as shard:
            yield from _content_problems(shard, task)
    except ShardError as error:
        yield _without_path(error, path)
    except H5_ERRORS as error:
        yield _without_path(damaged(path, error), path)


def _content_problems(shard: Shard, task: _Task) -> Iterator[str]:
    entry = task.entry
    structure = tuple(structure_problems(shard))
    yield from structure
    if structure:
        return  # the rest relies on it
    if shard.path.name != f"{shard.scene}.h5":
        yield f"holds {shard.scene}; rename it back"
    if entry is not None and entry.frames != shard.rows:
        yield f"has not the manifest's {entry.frames} frames; {REMEDY}"
    if task.stored is not None:
        here = _configuration(shard.dataset_version, shard.settings)
        yield from (
            f"contradicts the manifest: {different}; {REMEDY}" for different in differences(here, task.stored)
        )
    yield from label_contradictions(shard)
    for camera in shard.cameras:
        problems = cross_problems(shard, camera)
        yield from problems
        yield from further_problems(shard, camera)
        yield from added_problems(shard, camera)
        if not problems:
            yield from seen_problems(shard, camera)


def _without_path(error: ShardError, path: Path) -> str:
    return str(error).removeprefix(f"{path}: ")
