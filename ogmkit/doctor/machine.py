"""The machine: processors, memory, devices, disks, the cache."""

import os
import platform
import shutil
import sys
import tempfile
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from ogmkit.errors import OutputError
from ogmkit.nuscenes.mask_cache import cache_folder, cached_masks

_PREFIX = "OGMKIT_"


@dataclass(frozen=True)
class Disk:
    """Where files go.

    Attributes:
        purpose: what for.
        folder: the folder, or the nearest one above it that there is.
        free_bytes: of its disk.
        total_bytes: of its disk.
        writable: whether this process may write there.
    """

    purpose: str
    folder: Path
    free_bytes: int
    total_bytes: int
    writable: bool


@dataclass(frozen=True)
class Cache:
    """Decoded map masks.

    Attributes:
        folder: where they are.
        masks: how many.
        bytes: of all.
        problem: why it can't be read; empty where it can.
    """

    folder: Path
    masks: int
    bytes: int
    problem: str


@dataclass(frozen=True)
class Machine:
    """What programs run on.

    Attributes:
        python: release and implementation.
        system: the operating system.
        processors: that this process may use.
        memory_bytes: in all; None where the system doesn't say.
        devices: that networks can work on; none without torch.
        variables: of the environment that ogmkit reads, `NAME=value`.
    """

    python: str
    system: str
    processors: int
    memory_bytes: int | None
    devices: tuple[str, ...]
    variables: tuple[str, ...]


def machine() -> Machine:
    """This one."""
    affinity = getattr(os, "sched_getaffinity", None)
    return Machine(
        f"{platform.python_version()} ({platform.python_implementation()}) at {sys.prefix}",
        platform.platform(),
        len(affinity(0)) if affinity else os.cpu_count() or 1,
        _memory_bytes(),
        _devices(),
        tuple(f"{name}={value}" for name, value in sorted(os.environ.items()) if name.startswith(_PREFIX)),
    )


def disks() -> tuple[Disk, ...]:
    """Of the working folder, of temporary files and of the cache."""
    folders = {
        "working folder": Path.cwd(),
        "temporary files": Path(tempfile.gettempdir()),
        "cache": cache_folder(),
    }
    return tuple(_disk(purpose, folder) for purpose, folder in folders.items())


def cache() -> Cache:
    """The folder of decoded map masks."""
    folder = cache_folder()
    try:
        masks = cached_masks(folder)
    except OutputError as error:
        return Cache(folder, 0, 0, str(error))
    return Cache(folder, len(masks), sum(mask.bytes for mask in masks), "")


def _disk(purpose: str, folder: Path) -> Disk:
    there = next(one for one in (folder, *folder.absolute().parents) if one.is_dir())
    usage = shutil.disk_usage(there)
    return Disk(purpose, there, usage.free, usage.total, os.access(there, os.W_OK))


def _memory_bytes() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (ValueError, OSError, AttributeError):
        return None


def _devices() -> tuple[str, ...]:
    if find_spec("torch") is None:
        return ()
    try:
        names: tuple[str, ...] = import_module("ogmkit.learn.devices").all_devices()
        return names
    except Exception as error:  # a broken driver raises what it likes; that is to be reported
        return (f"torch fails: {type(error).__name__}: {error}",)
