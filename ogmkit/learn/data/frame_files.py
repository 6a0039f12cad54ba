"""Files with a place for each frame of a training, which its processes share."""

import shutil
from pathlib import Path

from ogmkit.base.atomic import output_errors
from ogmkit.errors import OutputError

_GB = 1e9


def make_file(path: Path, size: int, what: str, remedy: str) -> None:
    """Make a file of zeros, where there is room for it.

    Args:
        path: of the file; whoever asks for it removes it.
        size: in bytes.
        what: needs it, for the error.
        remedy: against a lack of room.

    Raises:
        OutputError: the disk is too full, or can't be written to.
    """
    with output_errors(path):
        free = shutil.disk_usage(path.parent).free
        if free < size:
            raise OutputError(
                f"{path.parent}: {what} needs {size / _GB:.1f} GB, {free / _GB:.1f} GB are free; {remedy}"
            )
        with path.open("wb") as file:
            file.truncate(size)
