"""News of long work: the library tells, and whoever called it may listen; else it is dropped."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True)
class Found:
    """What the work is about and where it runs, such as `850 scenes; 2 worker processes`; told before it."""

    text: str


@dataclass(frozen=True)
class Waiting:
    """Something begins that may take long and isn't counted, such as `decoding map singapore.png`."""

    text: str


@dataclass(frozen=True)
class State:
    """How the work stands beside the counts, such as `epoch 3/100, loss 0.12`; holds until the next one."""

    text: str


@dataclass(frozen=True)
class Passed:
    """A stage is over, with its result, such as `epoch 3/100: loss 0.12, iou 0.45`."""

    text: str


@dataclass(frozen=True)
class Stopping:
    """Ctrl-C or SIGTERM came, and the work stops after this `step` or `validation`."""

    after: str


@dataclass(frozen=True)
class Quitting:
    """It came again: the work stops as soon as Python gets to it."""


Progress = Callable[[int, int], None]
"""Called with (done, in all), in units of the work."""
News = Found | Waiting | State | Passed | Stopping | Quitting
Listener = Callable[[News], None]

_LISTENER: ContextVar[Listener | None] = ContextVar("listener", default=None)


def tell(news: News) -> None:
    """Tell the listener of this context, if there is one."""
    listener = _LISTENER.get()
    if listener is not None:
        listener(news)


@contextmanager
def listening(listener: Listener | None) -> Iterator[None]:
    """Inside, the listener gets all news of this thread; None drops them."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)
