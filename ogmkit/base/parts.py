"""Names of files that are being written, and what becomes of them where their process was killed."""

import functools
import os
import re
import socket
from contextlib import suppress
from pathlib import Path

_PART = re.compile(r"\..+\.(?:(?P<host>[\w-]+)-)?(?P<process>\d+)\.part")
_HOST = re.sub(r"[^\w-]", "_", socket.gethostname(), flags=re.ASCII)


def part_of(path: Path) -> Path:
    """The name under which this process writes a file; machines that share a folder have their own."""
    return path.with_name(f".{path.name}.{_HOST}-{os.getpid()}.part")


def is_part(path: Path) -> bool:
    """Whether the name is one that `part_of` gives."""
    return _PART.fullmatch(path.name) is not None


def remove_parts(folder: Path) -> None:
    """Remove what killed runs left behind; only where no other run is writing."""
    for path in folder.iterdir():
        if is_part(path):
            path.unlink(missing_ok=True)


@functools.cache
def remove_left(folder: Path) -> None:
    """Remove the parts of files whose processes, of this machine, are gone; once for each folder."""
    with suppress(OSError):  # they harm nobody
        for path in folder.iterdir():
            found = _PART.fullmatch(path.name)
            if found is not None and found["host"] in (None, _HOST) and not _runs(int(found["process"])):
                path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True  # another user's
    return True
