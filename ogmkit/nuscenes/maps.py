"""Drivable-area masks: each decoded once per machine into bits that all workers map into memory."""

import hashlib
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from filelock import FileLock
from PIL.Image import Image
from platformdirs import user_cache_path

from ogmkit.base.files import file_status, open_file
from ogmkit.base.news import Waiting, tell
from ogmkit.errors import DataFileError, OutputError
from ogmkit.nuscenes.png import read_grey_png
from ogmkit.typing import UInt8Array

_DRIVABLE = 255
_BLOCK_PIXELS = 1 << 24


@dataclass(frozen=True)
class _Header:
    """First bytes of a decoded mask: what it holds and of which state of its source."""

    rows: int
    columns: int
    source_bytes: int
    source_mtime_ns: int

    _FORMAT = struct.Struct("<8s4q24x")
    _MAGIC = b"ogmmask\x01"
    SIZE = _FORMAT.size

    @classmethod
    def read(cls, path: Path) -> Self | None:
        """Read a decoded mask's header; None where there is no whole file of this version."""
        try:
            with open_file(path) as file:
                data = file.read(cls.SIZE)
                file_bytes = os.fstat(file.fileno()).st_size
        except OSError:
            return None
        if len(data) < cls.SIZE:
            return None
        magic, *fields = cls._FORMAT.unpack(data)
        header = cls(*fields)
        return header if magic == cls._MAGIC and file_bytes == header._file_bytes else None

    def pack(self) -> bytes:
        return self._FORMAT.pack(
            self._MAGIC, self.rows, self.columns, self.source_bytes, self.source_mtime_ns
        )

    @property
    def source_state(self) -> tuple[int, int]:
        return self.source_bytes, self.source_mtime_ns

    @property
    def _file_bytes(self) -> int:
        return self.SIZE + self.rows * -(-self.columns // 8)


@dataclass(frozen=True)
class MapMask:
    """A decoded mask, opened on first use and light to pickle; row 0 is the map's northern edge.

    Attributes:
        path: the decoded file.
        shape: (rows, columns) in pixels.
    """

    path: Path
    shape: tuple[int, int]

    @cached_property
    def _bits(self) -> UInt8Array:
        header = _Header.read(self.path)
        if header is None or (header.rows, header.columns) != self.shape:
            raise DataFileError(f"{self.path}: decoded map mask was removed or changed in use; run again")
        return np.memmap(self.path, np.uint8, "r", _Header.SIZE, (self.shape[0], -(-self.shape[1] // 8)))

    def __reduce__(self) -> tuple[type["MapMask"], tuple[Path, tuple[int, int]]]:
        """Pickle without the memory map, which would be copied whole."""
        return MapMask, (self.path, self.shape)

    def window(self, row0: int, row1: int, column0: int, column1: int) -> UInt8Array:
        """Unpack rows row0 … row1 − 1 and columns column0 … column1 − 1, all inside the mask.

        Returns:
            (row1 − row0, column1 − column0) uint8, 1 = drivable.
        """
        first_byte = column0 // 8
        packed = self._bits[row0:row1, first_byte : -(-column1 // 8)]
        return np.unpackbits(packed, axis=1)[:, column0 - 8 * first_byte : column1 - 8 * first_byte]


@dataclass(frozen=True)
class MaskStore:
    """Decoded masks in a folder that all workers and runs share.

    Attributes:
        cache_dir: that folder; None means the platform's cache folder for ogmkit.
    """

    cache_dir: Path | None = None

    def open(self, png: Path) -> MapMask:
        """Open a mask, decoding it first unless its present state has been decoded before.

        Any number of processes may do so at once: one decodes, the others wait and find its work.

        Args:
            png: 8-bit greyscale (255 = drivable, as in the devkit's `MapMask`) or 1-bit PNG.

        Raises:
            DataFileError: the mask is absent, no such PNG, damaged, or larger than 2^31 pixels.
            OutputError: the cache folder can't be written.
        """
        try:
            source = file_status(png)
        except OSError as error:
            raise DataFileError(f"{png}: map mask can't be read ({error.strerror}); restore it") from error
        state = (source.st_size, source.st_mtime_ns)
        decoded = self._decoded_path(png)
        header = _current_header(decoded, state)
        if header is None:
            with _cache_errors(decoded.parent):
                decoded.parent.mkdir(parents=True, exist_ok=True)
                tell(Waiting(f"decoding map {png.name}"))
                # One lock for all masks: decoding takes a byte a pixel, so never two at a time.
                with FileLock(decoded.parent / "decoding.lock"):
                    header = _current_header(decoded, state) or _decode(png, decoded, state)
        return MapMask(decoded, (header.rows, header.columns))

    def _decoded_path(self, png: Path) -> Path:
        folder = user_cache_path("ogmkit") / "masks" if self.cache_dir is None else self.cache_dir
        name = hashlib.sha256(os.fsencode(png.resolve())).hexdigest()[:16]
        return folder / f"{name}.mask"


def _current_header(decoded: Path, state: tuple[int, int]) -> _Header | None:
    """The header of a decoded mask, if that is whole and made from the source's present state."""
    header = _Header.read(decoded)
    return header if header is not None and header.source_state == state else None


def _decode(png: Path, decoded: Path, state: tuple[int, int]) -> _Header:
    """Decode a mask into a file beside the target, which then takes its place whole."""
    image = read_grey_png(png)
    header = _Header(image.height, image.width, *state)
    partial = decoded.with_suffix(".partial")  # one name: what a killed run left is overwritten
    try:
        with partial.open("wb") as file:
            file.write(header.pack())
            for block in _packed_blocks(image):
                file.write(block)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(decoded)
    finally:
        partial.unlink(missing_ok=True)
    return header


def _packed_blocks(image: Image) -> Iterator[bytes]:
    """Rows as bits, in blocks that keep the memory beyond the decoded image small."""
    block_rows = max(1, _BLOCK_PIXELS // image.width)
    for row in range(0, image.height, block_rows):
        block = image.crop((0, row, image.width, min(row + block_rows, image.height)))
        yield np.packbits(np.asarray(block.convert("L")) == _DRIVABLE, axis=1).tobytes()


@contextmanager
def _cache_errors(folder: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, NotImplementedError) as error:  # the latter: a file system without locks
        raise OutputError(
            f"{folder}: decoded map masks can't be kept here ({error}); name another folder with --cache-dir"
        ) from error
