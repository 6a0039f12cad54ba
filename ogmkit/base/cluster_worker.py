"""What a Dask worker does with a unit of work, after it has seen that it may."""

import asyncio
import functools
import pickle
import socket
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from ogmkit import __version__
from ogmkit.base.units import Answer, limit_threads, run_unit
from ogmkit.errors import OgmkitError

_EXACT = ("numpy", "opencv-python-headless", "shapely", "h5py")
"""Packages whose releases decide bytes."""
_PATIENCE_S = 5.0
"""How long a shared folder may take to show on one machine what another has just made."""
_LOOK_S = 0.05

_LOCK = threading.Lock()
_BEGUN: Counter[str] = Counter()
_STOPPED: set[str] = set()


@dataclass(frozen=True)
class Terms:
    """What a worker must agree with.

    Attributes:
        run: a name that no other run has.
        releases: of ogmkit and the packages that decide bytes.
        shared: files and folders, absolute; all machines must see them.
        level: from which on log records are sent home.
    """

    run: str
    releases: tuple[tuple[str, str], ...]
    shared: tuple[Path, ...]
    level: int


@functools.cache
def releases() -> tuple[tuple[str, str], ...]:
    """Of ogmkit and the packages that decide bytes; empty for one that isn't there by that name."""
    return ("ogmkit", __version__), *((name, _release(name)) for name in _EXACT)


def work(terms: Terms, packed: bytes) -> Answer[Any]:
    """Do a unit of work: a pickled function and its item."""
    try:
        _require_same_releases(terms.releases)
        _require_shared(terms.shared)
        with _begun(terms.run):
            limit_threads()  # before unpickling imports torch
            function, item = pickle.loads(packed)
            return run_unit(function, item, terms.level)
    except OgmkitError as error:
        return Answer((), error, ())


async def stop(run: str) -> None:
    """Begin nothing of a run any more, and return once what was begun has ended."""
    with _LOCK:
        _STOPPED.add(run)
    while _BEGUN[run]:
        await asyncio.sleep(_LOOK_S)


@contextmanager
def _begun(run: str) -> Iterator[None]:
    with _LOCK:
        if run in _STOPPED:
            raise OgmkitError("the command was ended")
        _BEGUN[run] += 1
    try:
        yield
    finally:
        with _LOCK:
            _BEGUN[run] -= 1


def _require_same_releases(wanted: tuple[tuple[str, str], ...]) -> None:
    for (name, here), (_, there) in zip(releases(), wanted, strict=True):
        if here != there:
            raise OgmkitError(
                f"worker {_name()} has {name} {here or 'not'}, this command {there}; install the same on all "
                "machines"
            )


@functools.cache
def _require_shared(shared: tuple[Path, ...]) -> None:
    """Look once; what raises is looked for again."""
    until = time.monotonic() + _PATIENCE_S
    for path in shared:
        while not path.exists():
            if time.monotonic() > until:
                raise OgmkitError(
                    f"worker {_name()} sees no {path}; the folder must be shared by all machines, under the "
                    "same path"
                )
            time.sleep(_LOOK_S)


def _name() -> str:
    from distributed import get_worker  # noqa: PLC0415  # of the extra; only workers get here

    return f"{get_worker().address} on {socket.gethostname()}"


def _release(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
