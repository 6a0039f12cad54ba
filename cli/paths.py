"""Types of options and arguments that are paths."""

from __future__ import annotations

import os
from pathlib import Path

import click


class UserPath(click.Path):
    """A path that may begin with `~`, also where no shell expands it: in `--out=~/x` or a variable.

    Args:
        exists: it has to be there.
        file_okay: it may be a file.
        dir_okay: it may be a folder.
    """

    def __init__(self, *, exists: bool = False, file_okay: bool = True, dir_okay: bool = True) -> None:
        super().__init__(exists=exists, file_okay=file_okay, dir_okay=dir_okay, path_type=Path)

    def convert(
        self,
        value: str | os.PathLike[str],
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> str | bytes | os.PathLike[str]:
        """Expand and check."""
        if not os.fspath(value):
            self.fail("the path is empty.", param, ctx)
        return super().convert(os.path.expanduser(value), param, ctx)


class ShardsPath(UserPath):
    """A folder of shards: a path, or an `s3://` URL, which becomes the local folder that stands for it.

    Args:
        exists: it has to be there; a remote one is taken to be.
        file_okay: it may be a file.
        whole: the command looks at the folder itself, so that all files are fetched first.
    """

    def __init__(self, *, exists: bool = False, file_okay: bool = True, whole: bool = False) -> None:
        super().__init__(exists=exists, file_okay=file_okay)
        self._whole = whole

    def convert(
        self,
        value: str | os.PathLike[str],
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> str | bytes | os.PathLike[str]:
        """Open what is remote, or check what is local."""
        from ogmkit.base.remote import is_url, open_mirror

        name = os.fspath(value)
        return open_mirror(name, whole=self._whole) if is_url(name) else super().convert(value, param, ctx)


ANY = UserPath()
"""A file or folder, there or not."""
EXISTING = UserPath(exists=True)
"""A file or folder that is there."""
EXISTING_FILE = UserPath(exists=True, dir_okay=False)
EXISTING_FOLDER = UserPath(exists=True, file_okay=False)
FILE = UserPath(dir_okay=False)
"""A file, there or not."""
FOLDER = UserPath(file_okay=False)
"""A folder, there or not."""
SHARDS = ShardsPath(exists=True, file_okay=False)
"""A folder of shards, read by its manifest."""
ALL_SHARDS = ShardsPath(exists=True, file_okay=False, whole=True)
"""A folder of shards with all that lies in it."""
NEW_SHARDS = ShardsPath(whole=True)
"""A folder of shards, there or not."""
SHARDS_OR_FILE = ShardsPath(exists=True)
