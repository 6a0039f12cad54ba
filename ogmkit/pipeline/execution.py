"""Running one function over many items: in this process, in worker processes, or on the caller's executor."""

import functools
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import TypeVar

import cv2
from threadpoolctl import threadpool_limits

from ogmkit.base.names import with_number
from ogmkit.errors import OgmkitError

Item = TypeVar("Item")
Result = TypeVar("Result")

_IN_FLIGHT = 256
"""Items that wait at most on an executor of unknown size."""


@dataclass(frozen=True)
class Execution:
    """How a command works through a folder; what it writes is the same.

    Attributes:
        workers: number of worker processes; 0 or 1 works in this process. They are started afresh ("spawn"),
            so a script needs its `if __name__ == "__main__":`.
        executor: runs the work instead of own processes; `workers` is ignored then.
        overwrite: rebuild what exists; each result is replaced only by its complete successor.
        on_progress: called with (items done, items in all).
    """

    workers: int = 0
    executor: Executor | None = None
    overwrite: bool = False
    on_progress: Callable[[int, int], None] | None = None

    @property
    def place(self) -> str:
        """Where the work is done, in words."""
        if self.executor is not None:
            return "on the executor given"
        return "in this process" if self.workers <= 1 else f"in {with_number(self.workers, 'worker process')}"

    def report(self, done: int, total: int) -> None:
        """Tell the caller how far the work is."""
        if self.on_progress is not None:
            self.on_progress(done, total)


DEFAULT_EXECUTION = Execution()
"""In this process, keeping what exists."""


def run_over(
    function: Callable[[Item], Result], items: Iterable[Item], execution: Execution = DEFAULT_EXECUTION
) -> Generator[Result]:
    """Yield results as they come; `items` is read only as far ahead as keeps the workers busy.

    On any exception, also Ctrl-C, the rest is given up: own worker processes end at once.

    Args:
        function: top-level function, picklable like its items and results.
        items: the work.
        execution: where the work is done.

    Raises:
        OgmkitError: a worker process died.
    """
    try:
        if execution.executor is not None:
            limited = functools.partial(_limited, function)
            with threadpool_limits(1, user_api="blas"):  # in threads of this process it can't be set
                yield from _as_completed(execution.executor, limited, items, _IN_FLIGHT, finish_started=True)
        elif execution.workers <= 1:
            with _one_thread():
                yield from map(function, items)
        else:
            with _worker_processes(execution.workers) as own:
                yield from _as_completed(own, function, items, 2 * execution.workers, finish_started=False)
    except BrokenExecutor as error:
        raise OgmkitError(
            f"a worker process died, perhaps for lack of memory ({error}); what was finished is whole: "
            "run again, with fewer --workers"
        ) from error


def _as_completed(
    executor: Executor,
    function: Callable[[Item], Result],
    items: Iterable[Item],
    limit: int,
    *,
    finish_started: bool,
) -> Iterator[Result]:
    waiting: set[Future[Result]] = set()
    try:
        for item in items:
            with interrupts_blocked():
                waiting.add(executor.submit(function, item))
            if len(waiting) >= limit:
                done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        while waiting:
            done, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in done)
    finally:
        for future in waiting:
            future.cancel()
        if finish_started:
            wait(waiting)


@contextmanager
def _worker_processes(workers: int) -> Iterator[Executor]:
    """A pool whose processes end at once when its parent dies or the block is left by an exception."""
    context = get_context("spawn")  # DuckDB's threads don't survive a fork
    ours, theirs = context.Pipe(duplex=False)
    executor = ProcessPoolExecutor(workers, context, _start_worker, (ours,))
    try:
        yield executor
    except BaseException:
        theirs.close()
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        theirs.close()
        ours.close()


def _start_worker(parent: Connection) -> None:
    cv2.setNumThreads(1)  # the workers are the parallelism
    threadpool_limits(1, user_api="blas")
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _limited(function: Callable[[Item], Result], item: Item) -> Result:
    """In the caller's worker: the last digits of BLAS depend on how many threads it has."""
    with threadpool_limits(1, user_api="blas"):
        return function(item)


def _end_with(parent: Connection) -> None:
    """End this process when the pipe's other end closes: nobody waits for the results any more."""
    parent.poll(None)
    os._exit(1)


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Processes started inside never see Ctrl-C, which is their parent's to handle."""
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


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
