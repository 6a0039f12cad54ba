"""Counting what is done, and choosing what is kept."""

from collections.abc import Callable

import numpy as np

Progress = Callable[[int, int], None]
"""Called with (done, total)."""
Tick = Callable[[], None]
"""Called after every frame or sequence of a pass."""


def ticker(on_progress: Progress | None, total: int) -> Tick:
    """What counts up to `total`, one at a call."""
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        if on_progress is not None:
            on_progress(done, total)

    return tick


def spread(count: int, of: int) -> frozenset[int]:
    """At most `count` numbers below `of`, the middles of equal parts."""
    return frozenset(((np.arange(count) + 0.5) * of / max(count, 1)).astype(int).tolist())
