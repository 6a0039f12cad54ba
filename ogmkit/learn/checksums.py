"""The checksum that a checkpoint carries: in its ZIP archive's comment, over all bytes before it.

Readers of ZIP archives pass comments by, torch's too, so that a checkpoint stays what `torch.load` takes.
"""

import hashlib
import os
from pathlib import Path
from typing import BinaryIO

from ogmkit.base.files import open_file
from ogmkit.errors import CheckpointError

_NAME = b"ogmkit sha256 "
_DIGEST_LENGTH = 64
"""Characters of a SHA-256, hexadecimal."""
_BLOCK = 1 << 20
_END = b"PK\x05\x06"
"""What the archive's last record begins with."""
_END_LENGTH = 22
"""Bytes of that record before the comment; the last two are the comment's length."""


def add_checksum(file: BinaryIO) -> None:
    """Add the checksum to a ZIP archive without a comment, open for reading and writing.

    Raises:
        OSError: the system refuses.
        ValueError: the file doesn't end as such an archive does.
    """
    file.seek(-_END_LENGTH, os.SEEK_END)
    if not file.read(_END_LENGTH).startswith(_END):
        raise ValueError("not a ZIP archive without a comment")
    file.seek(-2, os.SEEK_END)
    file.write((len(_NAME) + _DIGEST_LENGTH).to_bytes(2, "little") + _NAME)
    digest = _digest(file, file.tell())
    file.seek(0, os.SEEK_END)
    file.write(digest)


def require_checksum(path: Path, remedy: str) -> None:
    """Compare a file with the checksum that it carries.

    Args:
        path: the file.
        remedy: what messages advise.

    Raises:
        CheckpointError: it can't be read, carries none, or another one than its bytes have.
    """
    try:
        with open_file(path) as file:
            length = os.fstat(file.fileno()).st_size - _DIGEST_LENGTH
            file.seek(max(length - len(_NAME), 0))
            name, said = file.read(len(_NAME)), file.read()
            found = _digest(file, length) if name == _NAME else b""
    except OSError as error:
        raise CheckpointError(f"{path}: can't be read ({error.strerror or error}); {remedy}") from error
    if name != _NAME:
        raise CheckpointError(
            f"{path}: carries no checksum: cut short, or not a checkpoint of this version of ogmkit; nothing "
            f"of it was run; {remedy}"
        )
    if found != said:
        raise CheckpointError(f"{path}: is damaged: its checksum is another; nothing of it was run; {remedy}")


def _digest(file: BinaryIO, length: int) -> bytes:
    """SHA-256 of a file's first bytes, hexadecimal."""
    file.seek(0)
    digest = hashlib.sha256()
    while length > 0 and (data := file.read(min(length, _BLOCK))):
        digest.update(data)
        length -= len(data)
    return digest.hexdigest().encode()
