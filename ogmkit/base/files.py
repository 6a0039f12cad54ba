"""The one door through which files are read: regular files only, never more than a limit, without waiting.

A named pipe would hold the reader up, and a device has no end. Whatever is refused is an OSError whose
`strerror` says why, so that callers name the file and the remedy as for any other file that can't be read.
"""

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path
from typing import Literal

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
    status = path.stat()
    _require_regular(path, status)
    return status


def open_file(path: Path) -> BufferedReader:
    """Open a regular file for reading bytes.

    Raises:
        OSError: as `file_status`, or permission is denied.
    """
    file_status(path)  # to open a pipe or a device may already have an effect
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    file = os.fdopen(descriptor, "rb")
    try:
        _require_regular(path, os.fstat(descriptor))  # it may have been replaced meanwhile
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
    """What a refusal says: of the file, or (`unreadable`) of the system, which may let it be read another time."""
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return "absent"
    return "damaged" if error.errno in (errno.EISDIR, errno.EINVAL, errno.EFBIG) else "unreadable"


def _require_regular(path: Path, status: os.stat_result) -> None:
    kind = stat.S_IFMT(status.st_mode)
    if kind == stat.S_IFDIR:
        raise IsADirectoryError(errno.EISDIR, "a folder, not a file", str(path))
    if kind != stat.S_IFREG:
        raise OSError(errno.EINVAL, f"{_KINDS.get(kind, 'something else')}, not a regular file", str(path))
