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
    What was not written is held, since HDF5 reads it again; that is little, for `check` follows soon.
    """

    _failure: OSError | None = None

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self._held: list[tuple[int, bytes]] = []
        self._size = 0

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
            self._fail(error)
        if rest:
            self._held.append((self.tell(), bytes(rest)))
            self._size = max(self._size, self.seek(len(rest), io.SEEK_CUR))
        return size

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401  # as above
        if self._failure is None:
            return super().readinto(buffer) or 0
        first, view = self.tell(), memoryview(buffer).cast("B")
        size = max(min(len(view), self._size - first), 0)
        there = super().readinto(view[:size]) or 0
        view[there:size] = bytes(size - there)
        for start, data in self._held:
            low, high = max(start, first), min(start + len(data), first + size)
            if low < high:
                view[low - first : high - first] = data[low - start : high - start]
        self.seek(first + size)
        return size

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        if whence == io.SEEK_END and self._failure is not None:
            return super().seek(self._size + offset)
        return super().seek(offset, whence)

    def truncate(self, size: int | None = None) -> int:
        size = self.tell() if size is None else size
        try:
            if self._failure is None:
                return super().truncate(size)
        except OSError as error:
            self._fail(error)
        self._size = size
        return size

    def _fail(self, error: OSError) -> None:
        here = self.tell()
        self._size = super().seek(0, io.SEEK_END)
        super().seek(here)
        self._failure = error


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
    with _Sink(path) as sink:
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
