"""Paths that a file or an option names."""

import os
from pathlib import Path


def place(path: Path | str, folder: Path = Path()) -> Path:
    """A path relative to a folder, without detours; `~` at its beginning is the user's home."""
    return Path(os.path.normpath(folder / os.path.expanduser(path)))
