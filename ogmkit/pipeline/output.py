"""The folder of an extraction: whose it is, what it was made with, and one run at a time."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ogmkit.base import locks
from ogmkit.base.atomic import output_errors, remove, write_json
from ogmkit.base.differences import differences
from ogmkit.base.parts import is_part
from ogmkit.errors import OutputError, ShardError, UnreadableShardError
from ogmkit.shards.faults import H5_ERRORS
from ogmkit.shards.manifest import (
    AMENDING,
    LOCK,
    MARKER,
    Manifest,
    read_json,
    read_manifest,
    unfinished_command,
)
from ogmkit.shards.manifest import NAME as MANIFEST
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings


@dataclass(frozen=True)
class Request:
    """What a run wants to make.

    Attributes:
        out: the folder.
        settings: of all its shards.
        dataset_version: the source's tables.
        scenes: chosen ones.
        overwrite: whether existing shards are rebuilt.
    """

    out: Path
    settings: ExtractSettings
    dataset_version: str
    scenes: tuple[str, ...]
    overwrite: bool

    @property
    def configuration(self) -> dict[str, Any]:
        """What all shards of the folder have in common."""
        return {"dataset_version": self.dataset_version, **self.settings.to_dict()}

    def path(self, scene: str) -> Path:
        """The scene's shard."""
        return self.out / f"{scene}.h5"


@dataclass(frozen=True)
class Contents:
    """What a folder holds besides the chosen scenes.

    Attributes:
        others: whole shards of scenes that were not chosen, with the same settings.
        checksums: file name → (bytes, SHA-256) by the manifest of a finished folder; else empty.
        untouched: names of files that nobody has written to since that manifest was.
    """

    others: tuple[Path, ...]
    checksums: dict[str, tuple[int, str]]
    untouched: frozenset[str]


def check_place(out: Path, dataroot: Path) -> None:
    """Refuse a folder inside the dataset, or the other way round.

    Raises:
        OutputError: one contains the other, or OUT is a file.
    """
    resolved_out, resolved_root = out.resolve(), dataroot.resolve()
    if resolved_out.is_relative_to(resolved_root) or resolved_root.is_relative_to(resolved_out):
        raise OutputError(f"{out}: OUT and DATAROOT ({dataroot}) lie in one another; choose another OUT")
    if out.exists() and not out.is_dir():
        raise OutputError(f"{out}: is a file; choose a folder as OUT")


def check_contents(request: Request) -> Contents:
    """Refuse a folder that isn't an extraction's, or whose shards were made with other settings.

    Raises:
        OutputError: the folder is foreign, or settings differ; names the differences.
    """
    out = request.out
    with output_errors(out):
        names = {path.name for path in out.iterdir() if not is_part(path)} if out.exists() else set()
    manifest = _manifest(out) if MANIFEST in names else None
    trusted = manifest if not names & {MARKER, AMENDING} else None
    untouched, known = _untouched(out, names, trusted), _known(trusted)
    shards = {
        name: there
        for name in names
        if (there := known if name in untouched else _shard_configuration(out / name)) is not None
    }
    only_shards = bool(shards) and names <= shards.keys() | {LOCK, MANIFEST, AMENDING}
    if names - {LOCK} and MARKER not in names and manifest is None and not only_shards:
        raise OutputError(f"{out}: is not empty, and no ogmkit run made it; choose another OUT")
    # A marker or manifest without shards binds nobody: a run that failed may be mended with other settings.
    declared = _declared(out, names, manifest) if shards else None
    if declared is not None and not request.overwrite:
        _refuse_difference(request, out, declared, "use --overwrite or another OUT")
    chosen = {request.path(scene).name for scene in request.scenes}
    for name, there in sorted(shards.items()):
        if name not in chosen:
            _refuse_difference(request, out / name, there, "choose its scene as well, or another OUT")
        elif declared is None and not request.overwrite:
            _refuse_difference(request, out / name, there, "use --overwrite or another OUT")
    return Contents(
        others=tuple(sorted(out / name for name in shards.keys() - chosen)),
        checksums={entry.file: (entry.bytes, entry.sha256) for entry in trusted.shards} if trusted else {},
        untouched=untouched,
    )


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Hold the folder for one run; made where it isn't there yet. What killed runs left is removed.

    Raises:
        OutputError: another run holds it, or it can't be written.
    """
    with locks.locked(out, LOCK):
        yield


def begin(request: Request) -> None:
    """Mark the folder as an extraction's, unfinished."""
    write_json(request.out / MARKER, request.configuration)


def has_shard(request: Request, scene: str) -> bool:
    """Whether the scene's shard is there, with the request's settings."""
    return _shard_configuration(request.path(scene)) == request.configuration


def finish(out: Path) -> None:
    """Take the mark away."""
    remove(out / MARKER)


def require_no_other_run(out: Path, command: str) -> bool:
    """Refuse a folder where the run of an extraction, or of another command on its shards, was cut short.

    Args:
        out: a folder of shards.
        command: the one that is about to run; it may resume where it was cut short itself.

    Returns:
        Whether nothing was cut short, so that the manifest knows the shards.

    Raises:
        OutputError: something else was.
    """
    if (out / MARKER).exists():
        raise OutputError(f"{out}: the extraction is unfinished; run `ogmkit extract` again first")
    unfinished = unfinished_command(out)
    if unfinished not in (None, command):
        raise OutputError(f"{out}: {unfinished} is unfinished; run `ogmkit {unfinished}` again first")
    return unfinished is None


def begin_amending(out: Path, command: str) -> None:
    """Mark the folder as one whose shards the command adds to."""
    write_json(out / AMENDING, {"command": command})


def finish_amending(out: Path) -> None:
    """Take the mark away, where there is one."""
    remove(out / AMENDING)


def _manifest(out: Path) -> Manifest | None:
    """The manifest; None where it is damaged or another program's."""
    try:
        return read_manifest(out)
    except ShardError:
        return None


def _declared(out: Path, names: set[str], manifest: Manifest | None) -> dict[str, Any] | None:
    """The configuration of the last run, as it said itself."""
    if MARKER in names:
        return read_json(out / MARKER)
    return _known(manifest)


def _known(manifest: Manifest | None) -> dict[str, Any] | None:
    """The configuration of all shards by their manifest."""
    if manifest is None:
        return None
    return {"dataset_version": manifest.dataset_version, **manifest.settings.to_dict()}


def _untouched(out: Path, names: set[str], manifest: Manifest | None) -> frozenset[str]:
    """Files of the size that the manifest says, and older than it: as they were when it was written."""
    if manifest is None:
        return frozenset()
    with output_errors(out):
        written_ns = (out / MANIFEST).stat().st_mtime_ns
        return frozenset(
            one.file
            for one in manifest.shards
            if one.file in names
            and (state := (out / one.file).stat()).st_size == one.bytes
            and state.st_mtime_ns < written_ns
        )


def _shard_configuration(path: Path) -> dict[str, Any] | None:
    """A shard's configuration; None if the file is not a shard or is damaged."""
    if path.suffix != ".h5":
        return None
    try:
        with Shard(path) as shard:
            return {"dataset_version": shard.dataset_version, **shard.settings.to_dict()}
    except UnreadableShardError:
        raise  # it may be sound
    except (ShardError, *H5_ERRORS):
        return None


def _refuse_difference(request: Request, path: Path, there: dict[str, Any], remedy: str) -> None:
    different = differences(request.configuration, there)
    if different:
        raise OutputError(f"{path}: {', '.join(different)}; {remedy}")
