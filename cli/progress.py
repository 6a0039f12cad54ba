"""Progress on stderr: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

LINE_EVERY_S = 10.0
"""Time between lines where stderr is no terminal, as under nohup or in a cluster's log."""


@contextmanager
def progress(total: int | None, unit: str, description: str) -> Iterator[Callable[[int, int], None]]:
    """Report progress with rate and time left.

    On a terminal it is a bar, which vanishes at the end, whatever ends it. Elsewhere it is a line every
    `LINE_EVERY_S` seconds; what takes less writes nothing.

    Args:
        total: how many there are, None where only the callback will tell.
        unit: what is counted, such as `scenes`.
        description: what is done, such as `extract`.

    Yields:
        A callback `(done, total)` for library functions that report progress.
    """
    if not sys.stderr.isatty():
        yield _Lines(unit, description, time.monotonic()).advance
        return
    from tqdm import tqdm

    with tqdm(total=total, unit=f" {unit}", desc=description, file=sys.stderr, leave=False) as bar:

        def advance(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield advance


@dataclass
class _Lines:
    """Writes `extract: 120 of 850 scenes, 4.0 scenes/s, 3:02 left`."""

    unit: str
    description: str
    started_s: float
    written_s: float | None = None
    first: int | None = None

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
        line = f"{self.description}: {done:,} of {total:,} {self.unit}, {rate:.3g} {self.unit}/s{left}"
        print(line, file=sys.stderr, flush=True)


def _clock(seconds: float) -> str:
    """Minutes and seconds, or hours, minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
