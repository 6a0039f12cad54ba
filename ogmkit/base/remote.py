"""Folders in an object store, by the local folders that stand for them (`ogmkit.base.mirror`).

HDF5 and DuckDB read local files: so a command works in such a folder, which is brought up to date first.
"""

import json
import os
import re
from hashlib import sha256
from pathlib import Path

from filelock import FileLock
from platformdirs import user_cache_path

from ogmkit.base.extras import require_packages
from ogmkit.base.mirror import EXTRA, FILES, KEYS, NAME, PACKAGES, Mirror
from ogmkit.base.places import place
from ogmkit.errors import OutputError, SettingsError

VARIABLE = "OGMKIT_REMOTE_DIR"
"""The environment variable that names the folder of all mirrors."""

_URL = re.compile(r"s3://[a-z0-9][a-z0-9.-]*(/[^/\0]+)*/?")
_LOCK = "lock"


def is_url(name: str) -> bool:
    """Whether a path is meant for a store: it begins with a protocol."""
    return re.match(r"[A-Za-z][A-Za-z0-9+.-]*://", name) is not None


def open_mirror(url: str, *, whole: bool = False, cache_dir: Path | None = None) -> Path:
    """The local folder that stands for a remote one, up to date.

    Args:
        url: such as `s3://bucket/shards`; credentials and endpoint as the client finds them.
        whole: fetch all files now, for a command that looks at the folder itself; else when they are read.
        cache_dir: folder of all mirrors; by default what OGMKIT_REMOTE_DIR names, or in the user's cache.

    Raises:
        SettingsError: the URL is not one of an `s3://` folder.
        MissingPackageError: the extra `remote` is not installed.
        OutputError: the store can't be reached or read, or the cache not written.
    """
    if not _URL.fullmatch(url):
        raise SettingsError(f"{url}: not a folder in an object store; write s3://BUCKET/FOLDER")
    require_packages(EXTRA, PACKAGES)
    url = url.rstrip("/")
    named = os.environ.get(VARIABLE)
    base = cache_dir or (place(named) if named else user_cache_path("ogmkit") / "remote")
    readable = re.sub(r"[^A-Za-z0-9]+", "-", url.partition("//")[2])[:60]
    own = base / f"{readable}-{sha256(url.encode()).hexdigest()[:12]}"
    mirror = Mirror(url, own / FILES)
    try:
        for folder in (mirror.folder, own / KEYS):
            folder.mkdir(parents=True, exist_ok=True)
        with FileLock(own / _LOCK):
            (own / NAME).write_text(json.dumps({"url": url}), encoding="utf-8")
        mirror.refresh(whole=whole)
    except OSError as error:
        said = (error.strerror or str(error)).removeprefix(f"{url}: ")  # a store's own errors name it
        raise OutputError(
            f"{url}: {said} ({error.filename or own}); see that the store can be reached, then run again"
        ) from error
    return mirror.folder
