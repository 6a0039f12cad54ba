"""What HDF5 raises, told apart: a shard that is damaged, and a system that doesn't let it be read."""

import errno
import os
import re
from pathlib import Path

from ogmkit.errors import ShardError, UnreadableShardError

H5_ERRORS = (OSError, RuntimeError, KeyError, ValueError, TypeError)
"""What h5py raises on damaged files, besides wrong values."""

MAY_BE_SOUND = "the shard may be sound"
"""What is said of a shard that the system refuses to read."""
AGAIN = "run `ogmkit extract` again"
REMEDY = f"remove it and {AGAIN}"

_ERRNO = re.compile(r"\berrno = (\d+)")
_OF_DAMAGE = (errno.EINVAL, errno.EOVERFLOW)
"""What the system says to places in a file that can't be: the file's own fault."""


def damaged(path: Path, error: Exception) -> ShardError:
    """What to raise where a shard's data can't be read."""
    reason = refusal(error)
    if reason:
        return unreadable(path, reason)
    return ShardError(f"{path}: is damaged inside ({error}); {REMEDY}")


def unreadable(path: Path, reason: str) -> UnreadableShardError:
    """What to raise where the system refuses to read a shard: nothing is said against the shard."""
    return UnreadableShardError(
        f"{path}: can't be read ({reason}); {MAY_BE_SOUND}: check permissions and the disk"
    )


def refusal(error: Exception) -> str:
    """What the system says; empty where the file was read and is at fault.

    h5py keeps the system's number in some exceptions, and in others only in the text.
    """
    number = error.errno if isinstance(error, OSError) else None
    if number is None:
        found = _ERRNO.search(str(error))
        number = int(found[1]) if found else None
    return "" if number is None or number in _OF_DAMAGE else os.strerror(number)
