"""Who sees Ctrl-C."""

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_AGAIN_S = 0.01


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Processes started inside never see Ctrl-C, which is their parent's to handle."""
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


@contextmanager
def sigterm_interrupts() -> Iterator[None]:
    """Inside, SIGTERM, by which schedulers announce that time is up, does as Ctrl-C, in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)


@contextmanager
def interrupts_heeded() -> Iterator[None]:
    """Raise Ctrl-C again where it gets lost: it can't leave a finaliser or callback that it came into.

    Python drops it there; a callback of HDF5 ends as another error, which it is the cause of.
    """
    previous = sys.unraisablehook
    pending: list[threading.Timer] = []

    def hook(unraisable: "sys.UnraisableHookArgs") -> None:
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            # Not at once: this very hook is what it can't leave.
            again = threading.Timer(_AGAIN_S, _thread.interrupt_main)
            again.daemon = True
            pending.append(again)
            again.start()
        else:
            previous(unraisable)

    sys.unraisablehook = hook
    try:
        yield
    except Exception as error:
        if _from_interrupt(error):
            raise KeyboardInterrupt from error
        raise
    finally:
        sys.unraisablehook = previous
        for again in pending:
            again.cancel()


def _from_interrupt(error: BaseException | None) -> bool:
    """Whether an error, or what caused it, is a Ctrl-C."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__
    return error is not None
