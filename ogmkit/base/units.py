"""Units of work in worker processes: one thread each; log records are returned with the result."""

import functools
import logging
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging.handlers import QueueHandler
from queue import SimpleQueue
from typing import Generic, TypeVar

import cv2
from threadpoolctl import threadpool_limits

from ogmkit.base.memory import keep_freed_memory
from ogmkit.errors import OgmkitError

Item = TypeVar("Item")
Result = TypeVar("Result")

_LOG = logging.getLogger("ogmkit")


@dataclass(frozen=True)
class Answer(Generic[Result]):
    """What comes home.

    Attributes:
        results: of the unit; none where it failed.
        error: why it failed.
        records: what the library logged meanwhile.
    """

    results: tuple[Result, ...]
    error: OgmkitError | None
    records: tuple[logging.LogRecord, ...]

    def unpacked(self) -> Result:
        """The result, once the records are logged here.

        Raises:
            OgmkitError: what the unit raised.
        """
        for record in self.records:
            logger = logging.getLogger(record.name)
            if logger.isEnabledFor(record.levelno):
                logger.handle(record)
        if self.error is not None:
            raise self.error
        return self.results[0]


def log_level() -> int:
    """From which level on the library's records are wanted in this process."""
    return _LOG.getEffectiveLevel()


def run_unit(function: Callable[[Item], Result], item: Item, level: int) -> Answer[Result]:
    """Do a unit of work in a worker, which is one thread wide; else as `answered`."""
    limit_threads()
    return answered(function, item, level)


def answered(function: Callable[[Item], Result], item: Item, level: int) -> Answer[Result]:
    """Do something for another process; errors other than the library's own are raised as they are.

    Args:
        function: what to do.
        item: to do it with.
        level: from which on log records are sent home.
    """
    results: tuple[Result, ...] = ()
    failure = None
    with _logged(level) as records:
        try:
            results = (function(item),)
        except OgmkitError as error:
            failure = error
    return Answer(results, failure, tuple(records))


@functools.cache
def limit_threads() -> None:
    """Make this worker process one thread wide for good: the workers are the parallelism."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # of what is not imported yet, such as torch
    cv2.setNumThreads(1)
    threadpool_limits(1, user_api="blas")
    keep_freed_memory()


@contextmanager
def _logged(level: int) -> Iterator[list[logging.LogRecord]]:
    """Collect this thread's records; the list is filled at the end."""
    queue: SimpleQueue[logging.LogRecord] = SimpleQueue()
    handler = QueueHandler(queue)
    handler.setLevel(level)
    thread = threading.get_ident()
    handler.addFilter(lambda record: record.thread == thread)
    if level < _LOG.getEffectiveLevel():
        _LOG.setLevel(level)
    _LOG.addHandler(handler)
    records: list[logging.LogRecord] = []
    try:
        yield records
    finally:
        _LOG.removeHandler(handler)
        while not queue.empty():
            records.append(queue.get())
