"""Running one function over many items: in this process, in worker processes, or on a Dask cluster."""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import cv2
from threadpoolctl import threadpool_limits

from ogmkit.base import cluster, processes
from ogmkit.base.cluster import LOCAL
from ogmkit.base.interrupts import interrupts_blocked
from ogmkit.base.memory import keep_freed_memory
from ogmkit.base.names import with_number
from ogmkit.base.units import Answer

Item = TypeVar("Item")
Result = TypeVar("Result")

_LOOK_S = 1.0
"""Time between looks at whether the workers can still be reached."""


@dataclass(frozen=True)
class Execution:
    """How a command works through a folder; what it writes is the same.

    Attributes:
        workers: number of worker processes; 0 or 1 works in this process. They are started afresh ("spawn"),
            so a script needs its `if __name__ == "__main__":`.
        scheduler: address of a Dask scheduler, such as `tcp://10.0.0.7:8786`, whose workers do the work;
            `local` for a Dask cluster of `workers` processes of this machine; empty for none.
        overwrite: rebuild what exists; each result is replaced only by its complete successor.
        on_progress: called with (items done, items in all).

    Raises:
        SettingsError: the scheduler is neither `local` nor an address.
        MissingPackageError: there is one, and the extra `cluster` isn't installed.
    """

    workers: int = 0
    scheduler: str = ""
    overwrite: bool = False
    on_progress: Callable[[int, int], None] | None = None

    def __post_init__(self) -> None:
        if self.scheduler:
            cluster.require_usable(self.scheduler)

    @property
    def place(self) -> str:
        """Where the work is done, in words."""
        if self.scheduler == LOCAL:
            return f"in a Dask cluster of {with_number(max(self.workers, 1), 'worker process')}"
        if self.scheduler:
            return f"on the workers of {self.scheduler}"
        return "in this process" if self.workers <= 1 else f"in {with_number(self.workers, 'worker process')}"

    @property
    def beside(self) -> bool:
        """Whether other processes of this machine do the work, and share its files and caches."""
        return self.scheduler == LOCAL or (not self.scheduler and self.workers > 1)

    def require_reachable(self) -> None:
        """Refuse to begin where no scheduler answers.

        Raises:
            OgmkitError: none does.
        """
        if self.scheduler not in ("", LOCAL):
            cluster.require_reachable(self.scheduler)

    def report(self, done: int, total: int) -> None:
        """Tell the caller how far the work is."""
        if self.on_progress is not None:
            self.on_progress(done, total)


DEFAULT_EXECUTION = Execution()
"""In this process, keeping what exists."""


class Crew(Protocol):
    """Processes that take units of work."""

    def submit(self, function: Callable[[Item], Result], item: Item) -> Future[Answer[Result]]:
        """Hand over a unit."""

    def limit(self) -> int:
        """How many units may wait or be under way, so that nobody is idle."""

    def require_alive(self) -> None:
        """Raise an OgmkitError where nothing will come home any more."""


def run_over(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    execution: Execution = DEFAULT_EXECUTION,
    *,
    shared: Sequence[Path] = (),
) -> Generator[Result]:
    """Yield results as they come; `items` is read only as far ahead as keeps the workers busy.

    On any exception, also Ctrl-C, the rest is given up: own worker processes end at once, those of a cluster
    after the unit that they have begun.

    Args:
        function: top-level function, picklable like its items and results.
        items: the work.
        execution: where the work is done.
        shared: files and folders that all workers of a cluster must see under the same paths.

    Raises:
        OgmkitError: a worker process died, the scheduler can't be reached, or a worker of the cluster has
            another release or doesn't see a folder.
    """
    if not execution.scheduler and execution.workers <= 1:
        keep_freed_memory()
        with _one_thread():
            yield from map(function, items)
        return
    with _crew(execution, shared) as crew:
        yield from _as_completed(crew, function, items)


def run_in_order(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    execution: Execution = DEFAULT_EXECUTION,
    *,
    shared: Sequence[Path] = (),
) -> Generator[Result]:
    """As `run_over`, and the results have the items' order; those that come early are kept until then."""
    early: dict[int, Result] = {}
    following = 0
    with closing(run_over(_Numbered(function), enumerate(items), execution, shared=shared)) as results:
        for number, result in results:
            early[number] = result
            while following in early:
                yield early.pop(following)
                following += 1


@dataclass(frozen=True)
class _Numbered(Generic[Item, Result]):
    """A function whose results keep the numbers of their items."""

    function: Callable[[Item], Result]

    def __call__(self, item: tuple[int, Item]) -> tuple[int, Result]:
        number, value = item
        return number, self.function(value)


def _crew(execution: Execution, shared: Sequence[Path]) -> AbstractContextManager[Crew]:
    if execution.scheduler:
        return cluster.workers_of(execution.scheduler, execution.workers, shared)
    return processes.workers_of(execution.workers)


def _as_completed(crew: Crew, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    waiting: set[Future[Answer[Result]]] = set()

    def come() -> Iterator[Result]:
        nonlocal waiting
        done: set[Future[Answer[Result]]] = set()
        while not done:
            done, waiting = wait(waiting, _LOOK_S, FIRST_COMPLETED)
            crew.require_alive()
        yield from (future.result().unpacked() for future in done)

    try:
        for item in items:
            with interrupts_blocked():
                waiting.add(crew.submit(function, item))
            if len(waiting) >= crew.limit():
                yield from come()
        while waiting:
            yield from come()
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def _one_thread() -> Iterator[None]:
    """One worker is one core, as it is in a pool."""
    previous = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1, user_api="blas"):
            yield
    finally:
        cv2.setNumThreads(previous)
