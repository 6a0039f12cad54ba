"""Files that exist whole or not at all: written beside their place, synced, then renamed.

In a folder that stands for a remote one, they go to the store before that (`ogmkit.base.mirror`).
"""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ogmkit.base.mirror import published, removed
from ogmkit.base.parts import part_of, remove_left
from ogmkit.errors import OutputError


@contextmanager
def output_errors(path: Path) -> Iterator[None]:
    """Turn what the system refuses while writing `path` into an OutputError that names it."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"{path}: can't be written: {reason}; make room or choose another folder, then run again "
            "(files that were there are intact)"
        ) from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside `path`; what was written there takes its place at the end.

    Whatever is raised inside leaves `path` as it was and the temporary file removed. What killed processes
    left in the folder is removed as well.

    Raises:
        OutputError: the system refuses to write, or a device or a pipe has the name.
    """
    if not path.name or (path.exists() and not (path.is_file() or path.is_dir())):
        raise OutputError(f"{path}: is not a regular file that could be replaced; choose another name")
    part = part_of(path)
    with output_errors(path):
        remove_left(path.parent)
        try:
            yield part
            _sync(part)
            with published(part, path):
                part.replace(path)
            _sync(path.parent)
        except BaseException:
            part.unlink(missing_ok=True)
            raise


def remove(path: Path) -> None:
    """Remove a file, if it is there.

    Raises:
        OutputError: the system refuses.
    """
    with output_errors(path):
        removed(path)


def write_json(path: Path, content: object) -> None:
    """Write JSON atomically, with sorted keys.

    Raises:
        OutputError: the system refuses to write.
    """
    with replacing(path) as part:
        part.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def require_outside(path: Path, out: Path) -> None:
    """Keep other results out of a folder of shards, which holds nothing else.

    Raises:
        OutputError: `path` is `out` or lies in it.
    """
    if path.resolve().is_relative_to(out.resolve()):
        raise OutputError(f"{path}: lies in {out}, which holds nothing but shards; choose another place")


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
