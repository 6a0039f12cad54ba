"""The folder of decoded map masks: where it is, what it holds, and how it is emptied."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock
from platformdirs import user_cache_path

from ogmkit.base.places import place
from ogmkit.errors import OutputError
from ogmkit.nuscenes.decoded import Header

VARIABLE = "OGMKIT_CACHE_DIR"
"""The environment variable that names the folder."""

_LOCK = "decoding.lock"
_OURS = re.compile(r"[0-9a-f]{16}\.(mask|partial)")


@dataclass(frozen=True)
class CachedMask:
    """A decoded mask.

    Attributes:
        file: its name in the folder.
        bytes: its size.
        shape: (rows, columns) in pixels; (0, 0) where the file is damaged or of another version.
    """

    file: str
    bytes: int
    shape: tuple[int, int]


def cache_folder(cache_dir: Path | None = None) -> Path:
    """The folder: as given, else as OGMKIT_CACHE_DIR says, else in the user's cache folder."""
    if cache_dir is not None:
        return cache_dir
    named = os.environ.get(VARIABLE)
    return place(named) if named else user_cache_path("ogmkit") / "masks"


def cached_masks(folder: Path) -> tuple[CachedMask, ...]:
    """The decoded masks in a folder, by name, and what killed runs left; none if the folder is missing.

    Raises:
        OutputError: the folder, or a mask in it, can't be read.
    """
    with cache_errors(folder):
        return tuple(_cached_mask(path, Header.read(path)) for path in _masks(folder))


def clear_cache(folder: Path) -> tuple[CachedMask, ...]:
    """Remove the decoded masks of a folder, and nothing else in it.

    Waits for a mask that is being decoded. Runs that have masks open go on with them.

    Returns:
        What was removed.

    Raises:
        OutputError: the folder can't be read or written.
    """
    with cache_errors(folder):
        if not _masks(folder):
            return ()
    with decoding(folder):
        removed = {path: _cached_mask(path, readable_header(path)) for path in _masks(folder)}
        for path in removed:
            path.unlink(missing_ok=True)
    return tuple(removed.values())


def readable_header(path: Path) -> Header | None:
    """A decoded mask's header; None also where the system refuses to read it."""
    try:
        return Header.read(path)
    except OSError:
        return None


@contextmanager
def decoding(folder: Path) -> Iterator[None]:
    """Hold the folder while a mask is decoded: one at a time, since each takes a byte a pixel of memory.

    Raises:
        OutputError: the folder can't be written.
    """
    with cache_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / _LOCK):
            yield


@contextmanager
def cache_errors(folder: Path) -> Iterator[None]:
    """Turn what the system refuses into an OutputError that names the folder."""
    try:
        yield
    except (OSError, NotImplementedError) as error:  # the latter: a file system without locks
        raise OutputError(
            f"{folder}: decoded map masks can't be kept here ({error}); name another folder with --cache-dir "
            f"or {VARIABLE}"
        ) from error


def _masks(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if _OURS.fullmatch(path.name)) if folder.exists() else []


def _cached_mask(path: Path, header: Header | None) -> CachedMask:
    shape = (0, 0) if header is None else (header.rows, header.columns)
    return CachedMask(path.name, path.lstat().st_size, shape)
