"""The preloaded injector, seen from Python: compiled where gcc is, armed in a forked child."""

import ctypes
import errno
import mmap
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "shim.c"
KINDS = ("open", "read", "write", "fsync", "rename", "mkdir", "unlink", "stat", "list", "truncate")
ANY_CHANGE = "change"
"""Any operation that changes files."""
ACTIONS = ("fail", "fail on", "short", "kill", "torn")
"""As of `enum action`: it fails; it and all later ones; half is moved; killed before it; after half of it."""


class State(ctypes.Structure):
    """As `struct state` of shim.c."""

    _fields_ = (
        ("counts", ctypes.c_long * len(KINDS)),
        ("changes", ctypes.c_long),
        ("at", ctypes.c_long),
        ("kind", ctypes.c_long),
        ("action", ctypes.c_long),
        ("error", ctypes.c_long),
        ("hit", ctypes.c_long),
    )


@dataclass(frozen=True)
class Fault:
    """What is done to which operation.

    Attributes:
        kind: of the operation, or ANY_CHANGE.
        at: which one of them, from 1; 0 only counts.
        action: one of ACTIONS.
        error: the system's number.
    """

    kind: str = "open"
    at: int = 0
    action: str = "fail"
    error: int = 0

    def __str__(self) -> str:
        what = errno.errorcode[self.error] if self.error else self.action
        return f"{self.kind} {self.at}: {what}{' from here on' if self.action == 'fail on' else ''}"


COUNT = Fault()


def compile_shim(folder: Path) -> Path | None:
    """The library; None where gcc is absent."""
    gcc, library = shutil.which("gcc"), folder / "shim.so"
    if gcc is None:
        return None
    subprocess.run([gcc, "-O1", "-shared", "-fPIC", "-o", library, SOURCE, "-ldl"], check=True)
    return library


class Injector:
    """Memory that a child shares with its parent, and what arms the child."""

    def __init__(self) -> None:
        self._memory = mmap.mmap(-1, ctypes.sizeof(State))
        self.state = State.from_buffer(self._memory)
        self._arm = ctypes.CDLL(None).faults_arm

    def set(self, fault: Fault) -> None:
        """Forget what was counted; take the next child's fault."""
        ctypes.memset(ctypes.addressof(self.state), 0, ctypes.sizeof(State))
        self.state.kind = len(KINDS) if fault.kind == ANY_CHANGE else KINDS.index(fault.kind)
        self.state.at, self.state.error = fault.at, fault.error
        self.state.action = ACTIONS.index(fault.action)

    @property
    def hit(self) -> bool:
        """Whether the last child's fault came to pass."""
        return self.state.hit > 0

    def arm(self, folder: Path) -> None:
        """In the child: from here on, operations on files in the folder count."""
        self._arm(ctypes.byref(self.state), os.fsencode(folder))

    def counts(self) -> dict[str, int]:
        """Operations that the last child did, by kind."""
        return dict(zip(KINDS, self.state.counts, strict=True)) | {ANY_CHANGE: self.state.changes}
