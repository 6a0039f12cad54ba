"""The manifest of a run: what each step made, out of what, with which settings."""

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal, get_args

from ogmkit import __version__
from ogmkit.base.atomic import write_json
from ogmkit.base.files import read_text
from ogmkit.errors import MALFORMED, OutputError, ShardError

NAME = "manifest.json"
FORMAT = "ogmkit-run"
FORMAT_VERSION = 1

State = Literal["overwriting", "started", "done"]
"""What an earlier configuration made is being let go; the step's work is under way; it is all there."""


@dataclass(frozen=True)
class Record:
    """A step.

    Attributes:
        state: how far it is.
        fingerprint: of all that decides its result.
        settings: the step's own part of that.
        needed: other steps → the identities of what they had made.
        package_version: ogmkit's that did it.
        identity: of the result, for steps that need it: the fingerprint; of a training, which need not come
            out the same on a GPU, the checkpoint's checksum. Empty until it is done.
        files: what it made, relative to the run's folder.
        groups: what it added to each camera of the shards, such as `homography/surface`.
        note: the result in a few words.
        finished: when, UTC; empty until it is done.
        seconds: wall time of the call that finished it.
    """

    state: State
    fingerprint: str
    settings: Mapping[str, Any]
    needed: Mapping[str, str]
    package_version: str = __version__
    identity: str = ""
    files: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    note: str = ""
    finished: str = ""
    seconds: float = 0.0


def fingerprint(settings: Mapping[str, Any], needed: Mapping[str, str]) -> str:
    """SHA-256 of the canonical JSON of a step's settings, what it needs, and the package's version."""
    content = {"settings": settings, "needed": needed, "package_version": __version__}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def read_records(out: Path) -> dict[str, Record]:
    """The records of a folder, by the steps' names; none where no run has begun.

    Raises:
        ShardError: the manifest can't be read, is damaged or of another format version.
        OutputError: it is another program's.
    """
    path = out / NAME
    if not path.exists():
        return {}
    try:
        content = json.loads(read_text(path))
        if content["format"] != FORMAT:
            raise OutputError(f"{path}: is not the manifest of an `ogmkit run`; choose another `out`")
        if content["format_version"] != FORMAT_VERSION:
            found = content["format_version"]
            raise ShardError(f"{path}: has format {found}, not {FORMAT_VERSION}; choose another `out`")
        return {name: _record(values) for name, values in content["steps"].items()}
    except OSError as error:
        raise ShardError(f"{path}: can't be read ({error.strerror}); choose another `out`") from error
    except (AttributeError, *MALFORMED) as error:
        raise ShardError(
            f"{path}: is damaged ({error}); remove it and run again: what is whole is kept"
        ) from error


def write_records(out: Path, records: Mapping[str, Record]) -> None:
    """Write the manifest, whole or not at all.

    Raises:
        OutputError: the folder can't be written.
    """
    steps = {name: dataclasses.asdict(record) for name, record in records.items()}
    content = {"format": FORMAT, "format_version": FORMAT_VERSION, "steps": steps}
    write_json(out / NAME, content)


def _record(values: dict[str, Any]) -> Record:
    record = Record(**(values | {name: tuple(values[name]) for name in ("files", "groups")}))
    if record.state not in get_args(State):
        raise ValueError(f"state {record.state!r}")
    for file in record.files:
        place = PurePosixPath(file)
        if place.is_absolute() or ".." in place.parts:
            raise ValueError(f"file {file!r} leaves the folder")
    return record
