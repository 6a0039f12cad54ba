"""Whether a file looks like a table: a JSON array that is closed at its end."""

import codecs
import os
from pathlib import Path

from ogmkit.base.files import is_lfs_pointer, open_file
from ogmkit.errors import TableError

REMEDY = "extract the metadata archive again"

_HEAD_BYTES = 256


MISSING = "table is missing"
"""The kind of error that says so."""


def require_array(path: Path) -> None:
    """Refuse what DuckDB would accept or explain badly.

    Raises:
        TableError: the file is absent, empty, of another format, or cut off at the end.
    """
    try:
        with open_file(path) as file:
            head = file.read(_HEAD_BYTES).strip()
            file.seek(max(0, os.fstat(file.fileno()).st_size - _HEAD_BYTES))
            tail = file.read().rstrip()
    except FileNotFoundError as error:
        raise TableError(f"{path}: table is missing; {REMEDY}", kind=MISSING) from error
    except OSError as error:
        raise TableError(
            f"{path}: cannot be read ({error.strerror}); check the file and its permissions"
        ) from error
    if not head and not tail:
        raise TableError(f"{path}: empty file, not a JSON array of records; {REMEDY}")
    if is_lfs_pointer(head):
        raise TableError(f"{path}: a git-LFS pointer, not the table itself; run git lfs pull")
    if head.startswith(codecs.BOM_UTF8):
        raise TableError(f"{path}: begins with a byte-order mark; remove it: ogmkit check --fix")
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise TableError(f"{path}: UTF-16 text; write it as UTF-8")
    if head[:1] == b"<":
        raise TableError(f"{path}: an HTML or XML page, not a JSON table; download and {REMEDY}")
    if head[:1] == b"{":
        raise TableError(f"{path}: one JSON object, not an array of records; {REMEDY}")
    if head and head[:1] != b"[":
        raise TableError(f"{path}: not a JSON array of records; {REMEDY}")
    if tail[-1:] != b"]":
        raise TableError(f"{path}: cut off, the array of records is not closed; {REMEDY}")
