"""The injector where gcc is absent: Python's own functions, patched in a child; HDF5 and DuckDB escape it."""

import builtins
import io
import os
import signal
from collections.abc import Callable
from multiprocessing import RawArray
from pathlib import Path
from typing import Any

from harness.shim import ANY_CHANGE, COUNT, KINDS, Fault

_FUNCTIONS = {
    "open": ((os, "open"), (io, "open"), (builtins, "open")),
    "fsync": ((os, "fsync"),),
    "rename": ((os, "rename"), (os, "replace")),
    "mkdir": ((os, "mkdir"),),
    "unlink": ((os, "unlink"), (os, "remove"), (os, "rmdir")),
    "stat": ((os, "stat"), (os, "lstat")),
    "list": ((os, "scandir"), (os, "listdir")),
}
_CHANGES = {"fsync", "rename", "mkdir", "unlink"}


class PatchedInjector:
    """As `harness.shim.Injector`, by other means; nothing is read or written short, or torn."""

    def __init__(self) -> None:
        self._shared = RawArray("l", len(KINDS) + 2)
        self._fault = COUNT

    @property
    def hit(self) -> bool:
        """Whether the last child's fault came to pass."""
        return bool(self._shared[-1])

    def set(self, fault: Fault) -> None:
        """Forget what was counted; take the next child's fault."""
        self._fault = fault
        self._shared[:] = [0] * len(self._shared)

    def arm(self, folder: Path) -> None:
        """In the child: from here on, operations on files in the folder count."""
        for kind, places in _FUNCTIONS.items():
            for module, name in places:
                setattr(module, name, self._struck(kind, getattr(module, name), str(folder)))

    def counts(self) -> dict[str, int]:
        """Operations that the last child did, by kind."""
        return dict(zip((*KINDS, ANY_CHANGE), self._shared, strict=False))

    def _struck(self, kind: str, real: Callable[..., Any], folder: str) -> Callable[..., Any]:
        def function(*arguments: Any, **named: Any) -> Any:  # as of any of them
            if arguments and _inside(arguments[-1 if kind == "rename" else 0], folder):
                self._count(kind, arguments[0])
            return real(*arguments, **named)

        return function

    def _count(self, kind: str, path: object) -> None:
        self._shared[KINDS.index(kind)] += 1
        self._shared[len(KINDS)] += kind in _CHANGES
        if self._fault.kind not in ({kind, ANY_CHANGE} if kind in _CHANGES else {kind}):
            return
        n = self._shared[(*KINDS, ANY_CHANGE).index(self._fault.kind)]
        if not self._fault.at or (
            n < self._fault.at if self._fault.action == "fail on" else n != self._fault.at
        ):
            return
        self._shared[-1] += 1
        if self._fault.action in ("kill", "torn"):
            os.kill(os.getpid(), signal.SIGKILL)
        if self._fault.error:
            raise OSError(self._fault.error, os.strerror(self._fault.error), str(path))


def _inside(place: object, folder: str) -> bool:
    if isinstance(place, int):
        place = os.readlink(f"/proc/self/fd/{place}")
    return isinstance(place, str | Path) and os.path.join(os.getcwd(), place).startswith(folder)
