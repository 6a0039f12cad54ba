"""The one door through which files are read: regular files only, never more than a limit, without waiting.

A named pipe would hold the reader up, and a device has no end. Whatever is refused is an OSError whose
`strerror` says why, so that callers name the file and the remedy as for any other file that can't be read. It
names the file too, also while that is read, where the system alone doesn't.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader, FileIO
from pathlib import Path
from typing import Any, Literal

MAX_BYTES = 1 << 28
"""Of a file that is read whole: 256 MiB."""

_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def file_status(path: Path) -> os.stat_result:
    """Size and times of a regular file; for libraries that open files themselves, to be asked first.

    Raises:
        OSError: it is absent, can't be reached, or is a folder, pipe or device.
    """
    try:
        status = path.stat()
    except FileNotFoundError:
        from ogmkit.base.mirror import fetched  # noqa: PLC0415  # it reads through this door itself

        if not fetched(path):
            raise
        status = path.stat()
    _require_regular(path, status)
    return status


def open_file(path: Path) -> BufferedReader:
    """Open a regular file for reading bytes.

    Raises:
        OSError: as `file_status`, or permission is denied; also while it is read.
    """
    file_status(path)  # to open a pipe or a device may already have an effect
    file: BufferedReader = BufferedReader(_NamedFile(path, opener=_open))
    try:
        with _named(path):
            _require_regular(path, os.fstat(file.fileno()))  # it may have been replaced meanwhile
    except OSError:
        file.close()
        raise
    return file


def read_bytes(path: Path, most: int = MAX_BYTES) -> bytes:
    """All of a regular file.

    Args:
        path: the file.
        most: bytes that it may have.

    Raises:
        OSError: as `open_file`, or it is larger.
    """
    with open_file(path) as file:
        with _named(path):
            size = os.fstat(file.fileno()).st_size
        data = b"" if size > most else file.read(most + 1)
    if max(size, len(data)) > most:
        raise OSError(errno.EFBIG, f"larger than {most:,} bytes", str(path))
    return data


def read_text(path: Path, most: int = MAX_BYTES) -> str:
    """All of a regular file of UTF-8 text; arguments and errors as of `read_bytes`.

    Raises:
        UnicodeDecodeError: it is not UTF-8.
    """
    return read_bytes(path, most).decode("utf-8")


def is_lfs_pointer(head: bytes) -> bool:
    """Whether a file that begins so only stands for one that git-LFS has not fetched."""
    return head.startswith(b"version https://git-lfs.github.com/")


def fault_of(error: OSError) -> Literal["absent", "damaged", "unreadable"]:
    """What a refusal says: of the file, or (`unreadable`) of the system, which may let it be read later."""
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return "absent"
    return "damaged" if error.errno in (errno.EISDIR, errno.EINVAL, errno.EFBIG) else "unreadable"


def _require_regular(path: Path, status: os.stat_result) -> None:
    kind = stat.S_IFMT(status.st_mode)
    if kind == stat.S_IFDIR:
        raise IsADirectoryError(errno.EISDIR, "a folder, not a file", str(path))
    if kind != stat.S_IFREG:
        raise OSError(errno.EINVAL, f"{_KINDS.get(kind, 'something else')}, not a regular file", str(path))


class _NamedFile(FileIO):
    """A file whose refusals to be read name it."""

    def readinto(self, buffer: Any, /) -> int | None:  # noqa: ANN401  # as of `FileIO`
        with _named(self.name):
            return super().readinto(buffer)

    def readall(self) -> bytes:
        with _named(self.name):
            return super().readall()


@contextmanager
def _named(path: Path | str) -> Iterator[None]:
    """Name the file in what the system refuses."""
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise


def _open(name: str, flags: int) -> int:
    """Without waiting for whoever would write into a pipe that has taken the file's place."""
    return os.open(name, flags | os.O_NONBLOCK)
