"""One command at a time in a folder."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from ogmkit.base.atomic import output_errors
from ogmkit.base.parts import remove_parts
from ogmkit.errors import OutputError


@contextmanager
def locked(folder: Path, name: str) -> Iterator[None]:
    """Hold a folder; made where it isn't there yet. Parts of files that killed commands left are removed.

    Args:
        folder: to be held.
        name: of the file that is locked. A killed command leaves it, and it holds nobody up.

    Raises:
        OutputError: another command holds the folder, or it can't be written.
    """
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / name, timeout=0)
        try:
            lock.acquire()
        except Timeout as error:
            raise OutputError(f"{folder}: another ogmkit command is writing here; wait for it") from error
        except NotImplementedError as error:
            raise OutputError(f"{folder}: this file system has no locks; choose another OUT") from error
    try:
        with output_errors(folder):
            remove_parts(folder)
        yield
    finally:
        with output_errors(folder):
            remove_parts(folder)
            (folder / name).unlink(missing_ok=True)
            lock.release()
