"""Progress on stderr: a bar on a terminal, log lines elsewhere."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ogmkit.base.news import Found, News, Passed, Quitting, State, Stopping, Waiting, listening

from .logs import note, quiet

if TYPE_CHECKING:
    from typing import Protocol

    class Reporter(Protocol):
        """Shows how far the work is."""

        def advance(self, done: int, total: int) -> None:
            """Show the counts."""

        def hear(self, news: News) -> None:
            """Show what else there is to know."""


LINE_EVERY_S = 10.0
"""Time between lines where stderr is not a terminal, as under nohup or in a cluster's log."""
RESUMES = "interrupted; run the same command to resume"
_PATIENCE_S = 2.0
"""After a second Ctrl-C: time for Python to end by itself, which it can't in the middle of a long C call."""


@contextmanager
def progress(total: int | None, unit: str, description: str) -> Iterator[Callable[[int, int], None]]:
    """Report what was found, what is waited for, and progress with rate and time left.

    On a terminal it is a bar, which vanishes at the end, whatever ends it. Elsewhere it is a line every
    `LINE_EVERY_S` seconds, and one for each stage that ends. With -q there is neither.

    Args:
        total: how many there are, None where only the callback will tell.
        unit: what is counted, such as `scenes`.
        description: what is done, such as `extract`.

    Yields:
        A callback `(done, total)` for library functions that report progress. News that they tell inside
        the block is shown too.
    """
    if quiet() or not sys.stderr.isatty():
        with _heard(_Lines(unit, description, time.monotonic())) as advance:
            yield advance
        return
    from tqdm import tqdm

    with (
        tqdm(total=total, unit=f" {unit}", desc=description, file=sys.stderr, leave=False) as bar,
        _heard(_Bar(bar)) as advance,
    ):
        yield advance


@contextmanager
def _heard(reporter: Reporter) -> Iterator[Callable[[int, int], None]]:
    """Listen to the library's news for a reporter; what Ctrl-C does is told in the same words by all."""
    quitting = threading.Timer(_PATIENCE_S, _quit)
    quitting.daemon = True

    def hear(news: News) -> None:
        if isinstance(news, Stopping):
            note(f"ogmkit: stopping after this {news.after}; press Ctrl-C again to quit now")
        elif isinstance(news, Quitting):
            if not quitting.is_alive():
                quitting.start()
        else:
            reporter.hear(news)

    try:
        with listening(hear):
            yield reporter.advance
    finally:
        quitting.cancel()


def _quit() -> None:
    """End the process, whatever it is in the middle of; files are written whole or not at all."""
    note(f"ogmkit: {RESUMES}")
    os._exit(128 + signal.SIGINT)


@dataclass
class _Bar:
    """Moves a bar; what was found stands above it."""

    bar: Any  # tqdm has no types
    waiting: bool = False

    def advance(self, done: int, total: int) -> None:
        """Move the bar."""
        if self.waiting:
            self._show("")
        self.bar.total = total
        self.bar.update(done - self.bar.n)

    def hear(self, news: News) -> None:
        """Write what was found; show after the bar what changes."""
        if isinstance(news, Found):
            note(f"{self.bar.desc}: {news.text}")
        elif isinstance(news, State | Waiting):
            self._show(news.text, waiting=isinstance(news, Waiting))

    def _show(self, text: str, *, waiting: bool = False) -> None:
        self.waiting = waiting
        self.bar.set_postfix_str(text, refresh=waiting)


@dataclass
class _Lines:
    """Writes `extract: 120 of 850 scenes, 4.0 scenes/s, 3:02 left`."""

    unit: str
    description: str
    started_s: float
    written_s: float | None = None
    first: int | None = None
    state: str = ""

    def hear(self, news: News) -> None:
        """Write a line; a state waits for the next one on progress."""
        if self.first is None:
            self.started_s = time.monotonic()  # what comes before the counted work says nothing of its rate
        if isinstance(news, State):
            self.state = f", {news.text}"
        elif isinstance(news, Found | Waiting | Passed):
            note(f"{self.description}: {news.text}")

    def advance(self, done: int, total: int) -> None:
        """Write a line if the last one is old enough."""
        now_s = time.monotonic()
        if self.first is None:
            self.first = max(done - 1, 0)  # a resumed run begins with what was there
        if now_s - (self.started_s if self.written_s is None else self.written_s) < LINE_EVERY_S:
            return
        self.written_s = now_s
        rate = (done - self.first) / (now_s - self.started_s)
        left = f", {_clock((total - done) / rate)} left" if rate > 0 else ""
        of_unit = f" {self.unit}" if self.unit else ""
        counts = f"{done:,} of {total:,}{of_unit}, {rate:.3g}{of_unit}/s"
        note(f"{self.description}: {counts}{left}{self.state}")


def _clock(seconds: float) -> str:
    """Minutes and seconds, or hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
