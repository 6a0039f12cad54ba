"""A file below HDF5 that never fails: the HDF5 library crashes the process when a write does."""

import io
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import h5py


class _Sink(io.FileIO):
    """A file that remembers the first failure and from then on only pretends to write.

    HDF5 1.14 can't close a file whose flush failed (disk full, quota): it keeps the broken file open and
    dies with a segmentation fault later. So it is told that all went well, and `check` tells the truth.
    """

    _failure: OSError | None = None

    def check(self) -> None:
        """Raise the first OSError that writing met, if any."""
        if self._failure is not None:
            raise self._failure

    def write(self, data: Any) -> int:  # noqa: ANN401  # any buffer, as io.FileIO has it
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while rest and self._failure is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self._failure = error
        return size

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self._failure = self._failure or error
            return size or 0


class ShardFile:
    """An HDF5 file that is being written."""

    def __init__(self, sink: _Sink, h5: h5py.File) -> None:
        self._sink = sink
        self._h5 = h5

    @contextmanager
    def writing(self) -> Iterator[h5py.File]:
        """The only place to call h5py in: Ctrl-C waits until its end.

        Raises:
            OSError: the disk refused something.
        """
        with _uninterrupted():
            yield self._h5
        self.check()

    def check(self) -> None:
        """Raise what the disk refused so far.

        Raises:
            OSError: the first failure, if any.
        """
        self._sink.check()


@contextmanager
def create(path: Path) -> Iterator[ShardFile]:
    """Create an HDF5 file; the same calls give the same bytes.

    Raises:
        OSError: the disk refused something, at the latest when the file is closed.
    """
    with _Sink(path, "w+") as sink:
        h5: h5py.File | None = None
        try:
            with _uninterrupted():
                h5 = h5py.File(sink, "w")
            yield ShardFile(sink, h5)
        finally:  # also where Ctrl-C came while the file was opened
            with _uninterrupted():
                if h5 is not None:
                    h5.close()
        sink.check()


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back: raised in HDF5's calls to the sink, it would crash the process as well."""
    if threading.current_thread() is not threading.main_thread():
        yield  # Python raises KeyboardInterrupt in the main thread only
        return
    received: list[tuple[int, FrameType | None]] = []
    previous = signal.signal(signal.SIGINT, lambda number, frame: received.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
        if received and callable(previous):
            previous(*received[0])
