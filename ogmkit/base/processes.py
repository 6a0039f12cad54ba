"""Worker processes of this machine, started afresh."""

import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import TypeVar

from ogmkit.base.units import Answer, limit_threads, log_level, run_unit
from ogmkit.errors import OgmkitError

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Processes:
    """Own worker processes."""

    executor: ProcessPoolExecutor
    workers: int

    def submit(self, function: Callable[[Item], Result], item: Item) -> Future[Answer[Result]]:
        """Hand over a unit."""
        return self.executor.submit(run_unit, function, item, log_level())

    def limit(self) -> int:
        """How many units may wait or be under way."""
        return 2 * self.workers

    def require_alive(self) -> None:
        """Futures of a broken pool end by themselves."""


@contextmanager
def workers_of(workers: int) -> Iterator[Processes]:
    """Processes that end at once when their parent dies or the block is left by an exception.

    Args:
        workers: how many.

    Raises:
        OgmkitError: one died.
    """
    context = get_context("spawn")  # DuckDB's threads don't survive a fork
    ours, theirs = context.Pipe(duplex=False)
    executor = ProcessPoolExecutor(workers, context, _start_worker, (ours,))
    try:
        yield Processes(executor, workers)
    except BrokenExecutor as error:
        theirs.close()
        raise OgmkitError(
            f"a worker process died, perhaps for lack of memory ({error}); what was finished is whole: "
            "run again, with fewer --workers"
        ) from error
    except BaseException:
        theirs.close()
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        theirs.close()
        ours.close()


def end_with(parent: Connection) -> None:
    """From now on, end this process when the pipe's other end closes: nobody waits for results any more.

    Args:
        parent: a pipe from the parent process, which sends nothing through it.
    """

    def watch() -> None:
        parent.poll(None)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _start_worker(parent: Connection) -> None:
    limit_threads()
    end_with(parent)
