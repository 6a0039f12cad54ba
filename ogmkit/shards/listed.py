"""Shards compared with what the manifest says of them, before anything in them is read."""

from pathlib import Path

from ogmkit.errors import ShardError
from ogmkit.shards.faults import REMEDY, damaged
from ogmkit.shards.manifest import ShardEntry, file_sha256, unfinished_command
from ogmkit.shards.opening import shard_bytes
from ogmkit.shards.reader import Shard


def listed_shard(out: Path, entry: ShardEntry) -> Shard:
    """A shard of a finished folder, open, if it has the size that the manifest says.

    While a command adds to shards, or where one was cut short, the manifest may not know the sizes.

    Args:
        out: the folder.
        entry: the manifest's.

    Raises:
        ShardError: the shard is absent, of another size, damaged, or of another format version.
        UnreadableShardError: the system refuses to read it.
    """
    path = out / entry.file
    wrong = _size_problem(path, entry)
    if wrong and unfinished_command(out) is None:
        raise ShardError(f"{path}: {wrong}; {REMEDY}")
    return Shard(path)


def require_unchanged(path: Path, entry: ShardEntry) -> None:
    """Refuse a shard that isn't the one that the manifest knows; reads all its bytes, but not as HDF5.

    Args:
        path: the shard's file.
        entry: the manifest's.

    Raises:
        ShardError: it is absent, or has another size or checksum.
        UnreadableShardError: the system refuses to read it.
    """
    wrong = _size_problem(path, entry)
    try:
        if not wrong and file_sha256(path) != entry.sha256:
            wrong = "has another checksum than the manifest says"
    except OSError as error:
        raise damaged(path, error) from error
    if wrong:
        raise ShardError(f"{path}: {wrong}; {REMEDY}")


def _size_problem(path: Path, entry: ShardEntry) -> str:
    size = shard_bytes(path)
    return "" if size == entry.bytes else f"has {size} bytes, by the manifest {entry.bytes}"
