"""One command in one forked process: what it wrote, how it ended, how long and how large it was."""

import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ogmkit_cli.main import main

from harness.patched import PatchedInjector
from harness.shim import COUNT, Fault, Injector

LIMIT_S = 20.0
_MEMORY_LIMIT = 6 << 30
"""Bytes of data: ends what would take the machine down."""


@dataclass(frozen=True)
class Ended:
    """How a process ended.

    Attributes:
        code: exit code; −1 where a signal ended it.
        signal: that signal, else 0.
        timed_out: it ran longer than the limit.
        stdout: text.
        stderr: text.
        kept: the traceback that the command kept in a file.
        seconds: wall time.
        peak_bytes: most memory, with what the parent had.
        hit: whether the fault came to pass.
        counts: operations by kind.
    """

    code: int
    signal: int
    timed_out: bool
    stdout: str
    stderr: str
    kept: str
    seconds: float
    peak_bytes: int
    hit: bool
    counts: dict[str, int]


class Forker:
    """Runs commands in children of this process, in one working folder."""

    def __init__(self, folder: Path, injector: Injector | PatchedInjector) -> None:
        self.case = folder / "case"
        self._streams = folder / "streams"
        self._injector = injector
        self._streams.mkdir(parents=True, exist_ok=True)

    def command(
        self, arguments: tuple[str, ...], fault: Fault = COUNT, kill_after_s: float | None = None
    ) -> Ended:
        """Run `ogmkit …` in the case's folder."""
        return self.call(lambda: self.run_ogmkit(arguments), fault, kill_after_s)

    @staticmethod
    def run_ogmkit(arguments: tuple[str, ...]) -> None:
        """As the console script does; ends with SystemExit."""
        sys.argv = ["ogmkit", *arguments]
        main(prog_name="ogmkit")

    def call(
        self, function: Callable[[], object], fault: Fault = COUNT, kill_after_s: float | None = None
    ) -> Ended:
        """Run a function as if it were a program."""
        temporary = self._streams / "tmp"
        shutil.rmtree(temporary, ignore_errors=True)
        temporary.mkdir()
        self._injector.set(fault)
        start = time.monotonic()
        pid = os.fork()
        if pid == 0:
            self._child(function, temporary)
        ended, status, usage = _wait(pid, kill_after_s)
        return Ended(
            code=os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else -1,
            signal=os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0,
            timed_out=not ended,
            stdout=_text(self._streams / "stdout"),
            stderr=_text(self._streams / "stderr"),
            kept="\n".join(map(_text, sorted(temporary.glob("ogmkit-*.txt")))),
            seconds=time.monotonic() - start,
            peak_bytes=usage.ru_maxrss * 1024,
            hit=self._injector.hit,
            counts=self._injector.counts(),
        )

    def _child(self, function: Callable[[], object], temporary: Path) -> None:
        code = 1
        try:
            os.setsid()
            for number, name in ((1, "stdout"), (2, "stderr")):
                opened = os.open(self._streams / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
                os.dup2(opened, number)
            sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
            tempfile.tempdir = str(temporary)
            os.environ["OGMKIT_CACHE_DIR"] = "cache"
            os.chdir(self.case)
            resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY_LIMIT, _MEMORY_LIMIT))
            self._injector.arm(self.case)
            code = _exit_code(function)
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)


def _exit_code(function: Callable[[], object]) -> int:
    try:
        function()
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else int(error.code is not None)
    except BaseException:  # as the interpreter does
        traceback.print_exc()
        return 1
    return 0


def _wait(pid: int, kill_after_s: float | None) -> tuple[bool, int, resource.struct_rusage]:
    """Wait for a child, at most the limit; False where it had to be killed for its time."""
    watched = os.pidfd_open(pid)
    try:
        poll = select.poll()
        poll.register(watched, select.POLLIN)
        ended = bool(poll.poll(1000 * (LIMIT_S if kill_after_s is None else kill_after_s)))
    finally:
        os.close(watched)
    if not ended:
        os.killpg(pid, signal.SIGKILL)
    _, status, usage = os.wait4(pid, 0)
    return ended or kill_after_s is not None, status, usage


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="backslashreplace")
