"""The manifest of a folder of shards: what is there, with checksums, splits and settings."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ogmkit import __version__
from ogmkit.base.atomic import write_json
from ogmkit.base.files import open_file, read_text
from ogmkit.errors import MALFORMED, ShardError
from ogmkit.shards.settings import ExtractSettings

NAME = "manifest.json"
MARKER = ".ogmkit-extract.json"
"""Stands in a folder from a run's first moment until its manifest is written; holds the configuration."""
AMENDING = ".ogmkit-amend.json"
"""Stands there while shards are added to, until the manifest knows them again; names the command."""
LOCK = ".ogmkit-extract.lock"
"""Stands there while a run holds the folder; a killed run leaves it, and it holds nobody up."""

FORMAT = "ogmkit-manifest"
FORMAT_VERSION = 1
_CHECKSUM = "sha256"
_NAMES = {
    *("format", "format_version", "package_version", "dataset_version", "dataroot", "settings", "shards"),
}
"""What a manifest holds besides its checksum."""


@dataclass(frozen=True)
class ShardEntry:
    """One shard.

    Attributes:
        scene: the scene's name.
        file: the shard's name in the folder.
        location: the map's name.
        frames: frames over all cameras.
        bytes: the file's size.
        sha256: the file's checksum, hexadecimal.
        splits: the splits that the scene belongs to.
    """

    scene: str
    file: str
    location: str
    frames: int
    bytes: int
    sha256: str
    splits: tuple[str, ...]


@dataclass(frozen=True)
class Manifest:
    """A finished folder.

    Attributes:
        dataset_version: the source's tables, such as `v1.0-mini`.
        dataroot: the dataset's root when it was extracted; image paths are relative to it.
        settings: the same for all shards.
        shards: sorted by scene.
    """

    dataset_version: str
    dataroot: str
    settings: ExtractSettings
    shards: tuple[ShardEntry, ...]

    def split(self, name: str) -> tuple[ShardEntry, ...]:
        """The shards of a split.

        Raises:
            ShardError: no shard belongs to it.
        """
        found = tuple(shard for shard in self.shards if name in shard.splits)
        if not found:
            known = ", ".join(sorted({split for shard in self.shards for split in shard.splits}))
            raise ShardError(f"{NAME}: no shard is in split {name!r}; there is {known or 'none'}")
        return found


def write_manifest(out: Path, manifest: Manifest) -> None:
    """Write `manifest.json` atomically.

    Raises:
        OutputError: the folder can't be written.
    """
    content = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "package_version": __version__,
        "dataset_version": manifest.dataset_version,
        "dataroot": manifest.dataroot,
        "settings": manifest.settings.to_dict(),
        "shards": [asdict(shard) for shard in manifest.shards],
    }
    write_json(out / NAME, content | {_CHECKSUM: _checksum(content)})


def read_manifest(out: Path) -> Manifest:
    """Read a finished folder's manifest.

    Raises:
        ShardError: it is absent, damaged, or of another format version.
    """
    path = out / NAME
    content = read_json(path)
    if content.get("format") != FORMAT or content.get("format_version") != FORMAT_VERSION:
        raise ShardError(
            f"{path}: not an {FORMAT} of version {FORMAT_VERSION}; choose a folder that `ogmkit extract` "
            "wrote"
        )
    _require_unchanged(path, content)
    try:
        return Manifest(
            dataset_version=_text(content["dataset_version"]),
            dataroot=_text(content["dataroot"]),
            settings=ExtractSettings.from_dict(content["settings"]),
            shards=tuple(_entry(values) for values in content["shards"]),
        )
    except MALFORMED as error:
        raise ShardError(f"{path}: is damaged ({error}); run `ogmkit extract` again") from error


def _checksum(content: dict[str, Any]) -> str:
    """SHA-256 of the canonical JSON of a manifest without its checksum, hexadecimal."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _require_unchanged(path: Path, content: dict[str, Any]) -> None:
    """Compare a manifest with its checksum; those of earlier versions have none.

    Raises:
        ShardError: they differ, or the manifest holds what no version of ogmkit writes.
    """
    held = {name: value for name, value in content.items() if name != _CHECKSUM}
    said = content.get(_CHECKSUM, _checksum(held))
    if said != _checksum(held) or not held.keys() <= _NAMES:
        raise ShardError(f"{path}: is damaged (its checksum is another); run `ogmkit extract` again")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object that ogmkit wrote.

    Raises:
        ShardError: the file is absent, too large, or holds no JSON object.
    """
    try:
        content = json.loads(read_text(path))
    except OSError as error:
        raise ShardError(
            f"{path}: can't be read ({error.strerror}); choose a folder that `ogmkit extract` finished"
        ) from error
    except (ValueError, RecursionError) as error:
        raise ShardError(f"{path}: is damaged ({error}); remove it and run `ogmkit extract` again") from error
    if not isinstance(content, dict):
        raise ShardError(f"{path}: is damaged (no JSON object); remove it and run `ogmkit extract` again")
    return content


def unfinished_command(out: Path) -> str | None:
    """The command whose run on the folder's shards was cut short; None where there is none.

    Raises:
        ShardError: the mark it left is damaged.
    """
    path = out / AMENDING
    if not path.exists():
        return None
    command = read_json(path).get("command")
    if not isinstance(command, str):
        raise ShardError(f"{path}: is damaged (names no command); remove it and run `ogmkit extract` again")
    return command


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal."""
    with open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _entry(values: dict[str, Any]) -> ShardEntry:
    entry = ShardEntry(**(values | {"splits": tuple(values["splits"])}))
    if Path(entry.file).name != entry.file:
        raise ValueError(f"shard file {entry.file!r} leaves the folder")
    if not all(isinstance(number, int) for number in (entry.frames, entry.bytes)):
        raise ValueError(f"shard {entry.scene}: frames or bytes are no integers")
    return entry


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is not text")
    return value
