"""Ctrl-C and SIGTERM during a training: told of at once, obeyed where the state can be saved."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import copy_context
from types import FrameType

from ogmkit.base.news import Quitting, Stopping, tell

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupted(Exception):  # noqa: N818  # no error
    """The user pressed Ctrl-C, and what could be saved is saved.

    Not a KeyboardInterrupt: Lightning would end the process on that.
    """


class Interrupts:
    """Holds Ctrl-C back until somebody looks.

    Attributes:
        asked: whether it came.
    """

    def __init__(self) -> None:
        self.asked = False
        self._under_way = "step"
        self._told = 0

    @contextmanager
    def held(self) -> Iterator[None]:
        """Inside, the first Ctrl-C is remembered, the second one raises `Interrupted`; both are told of."""
        if threading.current_thread() is not threading.main_thread():
            yield  # Python raises KeyboardInterrupt in the main thread only
            return
        previous = signal.signal(signal.SIGINT, self._handle)
        try:
            with _noticed(self._tell):
                yield
        finally:
            signal.signal(signal.SIGINT, previous)

    def hold_sigterm(self) -> None:
        """SIGTERM, by which schedulers announce that time is up, does as Ctrl-C; Lightning resets it."""
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, self._handle)

    def begin(self, what: str) -> None:
        """What is under way now, and finished before the training stops: a `step` or a `validation`."""
        self._under_way = what
        if self.asked and what != "step":
            tell(Stopping(what))  # a step has ended, but this comes before the state can be saved

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise Interrupted
        self.asked = True

    def _tell(self) -> None:
        self._told += 1
        tell(Stopping(self._under_way) if self._told == 1 else Quitting())


@contextmanager
def _noticed(on_signal: Callable[[], None]) -> Iterator[None]:
    """Inside, a thread calls `on_signal` when a signal comes, even if the main thread is in C."""
    ours, theirs = os.pipe()
    os.set_blocking(theirs, False)
    previous = signal.set_wakeup_fd(theirs, warn_on_full_buffer=False)
    thread = threading.Thread(target=copy_context().run, args=(_watch, ours, on_signal), daemon=True)
    thread.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(previous)
        os.close(theirs)
        thread.join()
        os.close(ours)


def _watch(pipe: int, on_signal: Callable[[], None]) -> None:
    """Read numbers of signals until the other end closes."""
    while received := os.read(pipe, 16):
        for number in received:
            if number in _SIGNALS:
                on_signal()
