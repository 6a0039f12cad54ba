"""One scene of an extraction: its shard is made, found to be there, or given up; runs in a worker."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ogmkit.errors import DataFileError, FrameFileError, OgmkitError, OutputError, UnreadableShardError
from ogmkit.frames import SceneRecord
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.pipeline.frame_files import Absence, Refusal, prepare
from ogmkit.pipeline.output import Request
from ogmkit.pipeline.resuming import is_up_to_date
from ogmkit.shards.summary import Expected, ShardSummary, is_current, summarise
from ogmkit.shards.writer import write_shard


@dataclass(frozen=True)
class Task:
    """What a worker needs to know of a scene.

    Attributes:
        name: the scene's.
        scene: its records, or what is wrong with its tables.
        request: what the run wants to make.
        cache_dir: folder of decoded map masks; None for the platform's.
        checksum: (bytes, SHA-256) of the shard by the manifest; None where that knows none.
    """

    name: str
    scene: SceneRecord | OgmkitError
    request: Request
    cache_dir: Path | None
    checksum: tuple[int, str] | None


@dataclass(frozen=True)
class Outcome:
    """What became of a scene.

    Attributes:
        scene: its name.
        result: its shard, or why there is none.
        state: in a word.
        absent: the files that it lacks, where that is why.
    """

    scene: str
    result: ShardSummary | OgmkitError
    state: Literal["written", "kept", "failed", "left out"]
    absent: tuple[Absence, ...] = ()


@dataclass(frozen=True)
class Look:
    """A shard that may be what is wanted.

    Attributes:
        expected: what it should hold.
        request: what the run wants to make.
        checksum: as of `Task`.
        untouched: nobody has written to it since it was found whole.
    """

    expected: Expected
    request: Request
    checksum: tuple[int, str] | None
    untouched: bool


def kept(look: Look) -> Outcome | None:
    """The outcome of a scene whose shard is there and as wanted; else None.

    Raises:
        UnreadableShardError: the system refuses to read the shard.
    """
    request, scene = look.request, look.expected.scene
    path = request.path(scene)
    settings, version = request.settings, request.dataset_version
    if not is_current(path, look.expected, settings, version, whole=look.untouched):
        return None
    return Outcome(scene, _known(path, look.checksum), "kept")


def make_shard(task: Task) -> Outcome:
    """Make one shard, or find that it is there.

    Raises:
        OutputError: the disk is full or refuses otherwise.
        UnreadableShardError: the system refuses to read the shard that is there.
    """
    if isinstance(task.scene, OgmkitError):
        return Outcome(task.name, task.scene, "failed")
    request, path = task.request, task.request.path(task.name)
    try:
        if not request.overwrite and is_up_to_date(path, task.scene, request):
            return Outcome(task.name, _known(path, task.checksum), "kept")
        return _write(task, task.scene)
    except (OutputError, UnreadableShardError):
        raise  # a full disk would fail every scene: it ends the run
    except FrameFileError as error:
        return _given_up(task, Refusal(error, left_out=request.settings.only_complete))
    except OgmkitError as error:
        return Outcome(task.name, error, "failed")


def _write(task: Task, scene: SceneRecord) -> Outcome:
    """Make a shard of a scene, or of what the settings leave of it."""
    request, settings = task.request, task.request.settings
    prepared = prepare(scene, settings)
    if isinstance(prepared, Refusal):
        return _given_up(task, prepared)
    path = request.path(task.name)
    write_shard(
        path,
        prepared,
        settings.targets,
        MaskStore(task.cache_dir),
        dataset_version=request.dataset_version,
        compression=settings.compression,
        definitions=settings.definitions,
    )
    return Outcome(task.name, summarise(path), "written")


def _given_up(task: Task, why: Refusal) -> Outcome:
    """A scene without a shard; it can't be left out where it has one, which would go with the others."""
    path = task.request.path(task.name)
    if not why.left_out:
        return Outcome(task.name, why.error, "failed", why.absent)
    if path.exists():
        error = DataFileError(
            f"{path}: is from an earlier run and can't be rebuilt ({why.error.kind}); remove it, or choose "
            "another OUT",
            kind="shard of an earlier run can't be rebuilt",
        )
        return Outcome(task.name, error, "failed")
    return Outcome(task.name, why.error, "left out", why.absent)


def _known(path: Path, checksum: tuple[int, str] | None) -> ShardSummary:
    """The figures of a shard that was there; its checksum by the manifest, if the size agrees."""
    unchanged = checksum is not None and checksum[0] == path.stat().st_size
    return summarise(path, sha256=checksum[1] if checksum is not None and unchanged else None)
