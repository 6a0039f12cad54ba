"""Mirrors: local folders that stand for folders in an object store.

A file that isn't there is fetched when it is first read (`ogmkit.base.files`), and a file that is written
goes to the store, whole, before it takes its place (`ogmkit.base.atomic`). A mirror tells by the files beside
it that it is one, in every process.
"""

import errno
import json
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from filelock import FileLock

from ogmkit.base.extras import require_packages
from ogmkit.base.files import read_text
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, Waiting, tell
from ogmkit.base.parts import part_of

FILES, KEYS, NAME = "files", "keys", "mirror.json"
"""Names beside each other: the mirror itself, what the store said of each file, and its URL."""
EXTRA, PACKAGES = "remote", ("fsspec", "s3fs")
"""What a store needs beyond the core."""
_AT_ONCE = 8
"""Files that are fetched at once."""


@dataclass(frozen=True)
class Mirror:
    """A local folder and the remote one that it stands for.

    Attributes:
        url: of the remote folder, such as `s3://bucket/shards`.
        folder: the local one.
    """

    url: str
    folder: Path

    def fetch(self, name: str) -> None:
        """Bring a file here; another process's fetch of it is waited for.

        Raises:
            OSError: it is absent, or can't be had.
        """
        path = self.folder / name
        with FileLock(self._beside(f"{name}.lock")), _named(self.url, path):
            if path.exists():
                return
            there = self._info(name)
            part = part_of(path)
            try:
                self._store.get_file(self._remote(name), str(part))
                if part.stat().st_size != there.size:
                    raise OSError(errno.EIO, f"came with {part.stat().st_size} of {there.size} bytes")
                part.replace(path)
            finally:
                part.unlink(missing_ok=True)
            self._beside(name).write_text(there.key, encoding="utf-8")

    @contextmanager
    def publishing(self, part: Path, name: str) -> Iterator[None]:
        """Send a whole file under its name; inside, it takes its place here.

        The store shows the old object until all of the new one has arrived.

        Raises:
            OSError: the store refuses it, or is lost.
        """
        with FileLock(self._beside(f"{name}.lock")):
            self._beside(name).unlink(missing_ok=True)
            with _named(self.url, self.folder / name):
                self._store.put_file(str(part), self._remote(name))
                there = self._info(name)
                if there.size != part.stat().st_size:
                    raise OSError(errno.EIO, "another command writes there too: it has another size now")
            yield
            self._beside(name).write_text(there.key, encoding="utf-8")

    def remove(self, name: str) -> None:
        """Remove a file there, if there is one.

        Raises:
            OSError: the store refuses.
        """
        with _named(self.url, self.folder / name):
            if self._store.exists(self._remote(name)):
                self._store.rm_file(self._remote(name))

    def refresh(self, *, whole: bool) -> None:
        """Drop what has changed there or isn't there any more, and bring small files; all files if `whole`.

        Raises:
            OSError: the store can't be asked.
        """
        with _named(self.url, self.folder):
            there = self._listed()
        for path in self.folder.iterdir():
            if path.name.startswith(".") and not _is_small(path.name):
                continue  # a lock, or a part of a file
            with FileLock(self._beside(f"{path.name}.lock")):
                found = there.get(path.name)
                if found is None or self._known(path.name) != found.key:
                    path.unlink(missing_ok=True)
                    self._beside(path.name).unlink(missing_ok=True)
        size = sum(one.size for one in there.values())
        tell(Found(f"{self.url}: {with_number(len(there), 'file')}, {size:,} bytes; copies in {self.folder}"))
        absent = [name for name in there if (whole or _is_small(name)) and not (self.folder / name).exists()]
        if absent:
            tell(Waiting(f"fetching {with_number(len(absent), 'file')}"))
        with ThreadPoolExecutor(_AT_ONCE) as threads:
            for done in [threads.submit(self.fetch, name) for name in absent]:
                done.result()

    @cached_property
    def _store(self) -> Any:  # noqa: ANN401  # fsspec has no types
        require_packages(EXTRA, PACKAGES)
        import fsspec  # noqa: PLC0415  # not of the core, and slow

        return fsspec.filesystem(self.url.partition(":")[0], use_listings_cache=False)

    def _remote(self, name: str) -> str:
        return f"{self.url}/{name}"

    def _beside(self, name: str) -> Path:
        return self.folder.parent / KEYS / name

    def _known(self, name: str) -> str | None:
        """What the store said of the file that is here."""
        try:
            return read_text(self._beside(name))
        except FileNotFoundError:
            return None

    def _info(self, name: str) -> "_There":
        return _There.of(self._store.info(self._remote(name)))

    def _listed(self) -> dict[str, "_There"]:
        try:
            found = self._store.ls(self.url, detail=True)
        except FileNotFoundError:
            return {}
        files = {one["name"].rpartition("/")[2]: one for one in found if one["type"] == "file"}
        return {name: _There.of(one) for name, one in files.items() if name}


@dataclass(frozen=True)
class _There:
    """What a store says of a file.

    Attributes:
        size: bytes.
        key: changes with the content.
    """

    size: int
    key: str

    @classmethod
    def of(cls, info: Mapping[str, Any]) -> "_There":
        return cls(int(info["size"]), f"{info['size']} {info['ETag']}")


def mirror_of(folder: Path) -> Mirror | None:
    """The mirror that a folder is; None if it is an ordinary folder."""
    if folder.name != FILES:
        return None
    try:
        url = json.loads(read_text(folder.parent / NAME))["url"]
    except (OSError, ValueError, LookupError, TypeError):
        return None
    return Mirror(url, folder)


def fetched(path: Path) -> bool:
    """Download a missing file; False if its folder is not a mirror.

    Raises:
        OSError: it is absent there as well, or can't be had.
    """
    mirror = None if path.name.startswith(".") else mirror_of(path.parent)
    if mirror is None:
        return False
    mirror.fetch(path.name)
    return True


@contextmanager
def published(part: Path, path: Path) -> Iterator[None]:
    """Inside, a whole file takes its place: in a mirror, after it has gone to the store.

    Args:
        part: the file as it was written.
        path: its place.

    Raises:
        OSError: the store refuses it, or is lost.
    """
    mirror = mirror_of(path.parent)
    if mirror is None:
        yield
    else:
        with mirror.publishing(part, path.name):
            yield


def removed(path: Path) -> None:
    """Remove a file, if it is there; of a mirror, in the store first.

    Raises:
        OSError: the store or the system refuses.
    """
    mirror = mirror_of(path.parent)
    if mirror is not None:
        mirror.remove(path.name)
    path.unlink(missing_ok=True)


def _is_small(name: str) -> bool:
    """Whether it is a manifest or a mark: these may be absent, so that they are never left for later."""
    return name.endswith(".json")


@contextmanager
def _named(url: str, path: Path) -> Iterator[None]:
    """Make an OSError, with the file's name, of whatever the store's client raises."""
    try:
        yield
    except OSError as error:
        number = errno.ENOENT if isinstance(error, FileNotFoundError) else error.errno or errno.EIO
        raise OSError(number, f"{url}: {error.strerror or error}", str(path)) from error
    except Exception as error:  # the classes of botocore and aiohttp, which are no OSErrors
        said = str(error).partition("\n")[0] or type(error).__name__
        raise OSError(errno.EIO, f"{url}: {said}", str(path)) from error
