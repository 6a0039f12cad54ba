"""The record of an export, `export.json`: what its files are made of, and their checksums."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ogmkit import __version__
from ogmkit.base.atomic import output_errors, write_json
from ogmkit.base.differences import differences
from ogmkit.base.files import read_text
from ogmkit.base.parts import is_part
from ogmkit.errors import OutputError
from ogmkit.shards.manifest import file_sha256

NAME = "export.json"
LOCK = ".ogmkit-export.lock"
FORMAT = "ogmkit-export"
_REMEDY = "remove the folder, or choose another OUT"


@dataclass(frozen=True)
class ExportedFile:
    """One file.

    Attributes:
        file: below the folder, such as `cameras/scene-0001.tar`.
        table: what its rows are of.
        scene: the scene's name.
        splits: that the scene belongs to.
        rows: how many.
        bytes: its size.
        sha256: its checksum, hexadecimal.
    """

    file: str
    table: str
    scene: str
    splits: tuple[str, ...]
    rows: int
    bytes: int
    sha256: str


@dataclass(frozen=True)
class ExportSummary:
    """What a run did.

    Attributes:
        files: all of the folder.
        kept: how many of them were there before.
        seconds: wall time.
    """

    files: tuple[ExportedFile, ...]
    kept: int
    seconds: float

    @property
    def rows(self) -> int:
        """Over all files."""
        return sum(one.rows for one in self.files)

    @property
    def bytes(self) -> int:
        """Over all files."""
        return sum(one.bytes for one in self.files)


def begin(out: Path, configuration: Mapping[str, Any]) -> dict[str, ExportedFile]:
    """Mark a folder as an export that isn't finished; one of the same kind goes on.

    Args:
        out: the folder.
        configuration: what its files are made of.

    Returns:
        The files of an export that was finished here, by their names; empty where none was.

    Raises:
        OutputError: the folder holds something else, an export of something else, or a damaged record.
    """
    with output_errors(out):
        names = {path.name for path in out.iterdir() if not is_part(path)} - {LOCK}
    if NAME not in names:
        if names:
            raise OutputError(f"{out}: is not empty, and no export made it; choose another OUT")
        _write(out, configuration, complete=False, files=())
        return {}
    there = _read(out / NAME)
    different = differences(configuration, {name: there[name] for name in configuration if name in there})
    if there.get("format") != FORMAT or different:
        reason = ", ".join(different) or "is another program's"
        raise OutputError(f"{out / NAME}: {reason}; {_REMEDY}")
    return {one.file: one for one in there["files"]}


def is_whole(path: Path, recorded: ExportedFile | None) -> bool:
    """Whether a file is there: they get their names when they are whole, and keep what the record says."""
    return path.is_file() and (recorded is None or recorded.sha256 == file_sha256(path))


def finish(out: Path, configuration: Mapping[str, Any], files: Sequence[ExportedFile]) -> None:
    """Record all files.

    Raises:
        OutputError: the disk refuses.
    """
    _write(out, configuration, complete=True, files=files)


def _read(path: Path) -> dict[str, Any]:
    """The record, its files as `ExportedFile`."""
    try:
        content = json.loads(read_text(path))
        files = [ExportedFile(**(one | {"splits": tuple(one["splits"])})) for one in content["files"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise OutputError(f"{path}: is damaged ({error}); {_REMEDY}") from error
    return {**content, "files": files}


def _write(
    out: Path, configuration: Mapping[str, Any], *, complete: bool, files: Sequence[ExportedFile]
) -> None:
    content = {
        "format": FORMAT,
        "package_version": __version__,
        **configuration,
        "complete": complete,
        "files": [asdict(one) for one in files],
    }
    write_json(out / NAME, content)
