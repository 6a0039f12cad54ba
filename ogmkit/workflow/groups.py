"""What steps add to shards: whether it is there, and a folder where another command was cut short."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ogmkit.pipeline import output
from ogmkit.shards.fields import AddedKind
from ogmkit.shards.manifest import NAME, file_sha256, read_manifest, unfinished_command, write_manifest
from ogmkit.shards.reader import Shard


def groups_of(kind: AddedKind, names: Sequence[str]) -> tuple[str, ...]:
    """Where groups of a kind stand below a camera's, as a manifest has them."""
    return tuple(f"{kind.name}/{name}" for name in names)


def groups_gone(shards: Path, kind: AddedKind, names: Sequence[str], cameras: Sequence[str] = ()) -> str:
    """Which of some added groups a folder of shards lacks, in words; empty where it has all.

    Args:
        shards: the folder.
        kind: what the groups are.
        names: of the groups.
        cameras: that have them; none means all.

    Raises:
        ShardError: the manifest or a shard is damaged.
    """
    if not (shards / NAME).exists():
        return f"{NAME} is gone"
    for entry in read_manifest(shards).shards:
        if not (shards / entry.file).exists():
            return f"{entry.file} is gone"
        with Shard(shards / entry.file) as shard:
            for camera in cameras or shard.cameras:
                for name in names:
                    if name not in shard.added(camera, kind.name):
                        return f"{kind.name}/{name} is not in {entry.file}"
    return ""


def settle(shards: Path, command: str) -> None:
    """Bring the manifest of shards up to date where another command on them was cut short.

    Each shard is whole, old or new, but its checksum may be another by now; commands but the one that was
    cut short refuse to continue there.

    Raises:
        OutputError: another process writes there.
        ShardError: the manifest or a shard is absent or damaged.
    """
    if unfinished_command(shards) in (None, command):
        return
    with output.locked(shards):
        manifest = read_manifest(shards)
        entries = tuple(
            replace(entry, bytes=path.stat().st_size, sha256=file_sha256(path))
            for entry in manifest.shards
            for path in (shards / entry.file,)
        )
        write_manifest(shards, replace(manifest, shards=entries))
        output.finish_amending(shards)
