"""Opening shards to read them: regular files, without locks, and nothing in them that leads elsewhere."""

from pathlib import Path
from typing import Any

import h5py

from ogmkit.base.files import file_status
from ogmkit.errors import ShardError
from ogmkit.shards.faults import AGAIN, REMEDY, refusal, unreadable


def open_h5(path: Path) -> h5py.File:
    """Open a file for reading, without HDF5's locks.

    Shards are replaced whole, so that readers need no locks, which some file systems lack.

    Raises:
        ShardError: it is absent, or no whole HDF5 file.
        UnreadableShardError: the system refuses to read it.
    """
    shard_bytes(path)
    try:
        return _opened(path)
    except OSError as error:
        reason = refusal(error)
        if reason:
            raise unreadable(path, reason) from error
        raise ShardError(f"{path}: not an HDF5 file, or cut short; if it is a shard, {REMEDY}") from error


def shard_bytes(path: Path) -> int:
    """A shard's size; nothing of it is read.

    Raises:
        ShardError: it is absent.
        UnreadableShardError: it is not a regular file, or the system refuses to look at it.
    """
    try:
        return file_status(path).st_size
    except FileNotFoundError as error:
        raise ShardError(f"{path}: is absent; {AGAIN}") from error
    except OSError as error:
        raise unreadable(path, str(error.strerror)) from error


def _opened(path: Path) -> h5py.File:
    try:
        return h5py.File(path, "r", locking=False)
    except OSError as error:
        if "locking" not in str(error):
            raise
        return h5py.File(path, "r")  # it is open in this process already, by h5py's default: so it has to be


def refuse_links(path: Path, h5: h5py.File) -> None:
    """Refuse a file whose links lead to other files or places: a shard holds its data itself.

    Args:
        path: the file's, for messages.
        h5: the file, open; no link is followed.

    Raises:
        ShardError: there is such a link.
        OSError, RuntimeError: the file is damaged.
    """
    found: list[str] = []

    def note(name: bytes, link: Any) -> None:  # noqa: ANN401  # h5py has no types
        if link.type != h5py.h5l.TYPE_HARD:
            found.append(name.decode("utf-8", "backslashreplace"))

    h5.id.links.visit(note, info=True)
    if found:
        raise ShardError(f"{path}: /{found[0]} is a link to another place, not data; {REMEDY}")
