"""Names that come out of tables: safe as paths under the root, safe as file names."""

import re
from pathlib import Path

from ogmkit.errors import TableError

# Both patterns run in Python and in DuckDB (RE2): the rules look for them in whole tables.
UNSAFE_PATH = r"^$|^/|\\|[\x00-\x1f\x7f]|^[A-Za-z]:|(^|/)\.\.(/|$)"
"""Empty, absolute, with a backslash, a control character or a drive, or climbing through `..`."""
UNSAFE_NAME = r"^$|^\.|[/\\\x00-\x1f\x7f]|[. ]$"
"""Empty, hidden, with a separator or control character, or ending in a dot or space."""
MAX_NAME_BYTES = 200
"""Of a scene's name in UTF-8: file systems allow 255, and suffixes are added."""

_SHOWN_CHARACTERS = 400


def resolve(dataroot: Path, filename: str) -> Path:
    """The path of a file that a table names.

    Symbolic links are followed: whoever owns the folder placed them.

    Args:
        dataroot: the dataset's root folder.
        filename: relative to it, with `/` between folders.

    Raises:
        TableError: the name is empty, absolute, or leaves the root.
    """
    if re.search(UNSAFE_PATH, filename):
        raise TableError(
            f"{dataroot}: file name {filename!r} in the tables is not a path inside the dataset; "
            "correct it in sample_data.json or map.json"
        )
    return dataroot / filename


def one_line(text: str) -> str:
    """Text from tables made fit for a message: control characters escaped, at most 400 characters."""
    shown = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text[:_SHOWN_CHARACTERS])
    return shown if len(text) <= _SHOWN_CHARACTERS else shown + "…"
