"""The file of a decoded map mask: a header, the pixels as bits row by row, and a checksum for each tile.

Tiles are checked when something in them is read: to open a mask of a gigapixel takes no time.
"""

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray
from PIL.Image import Image

from ogmkit.base.files import open_file
from ogmkit.typing import UInt8Array

TILE_ROWS, TILE_BYTES = 128, 128
"""Sides of a tile: rows of pixels, and bytes of eight pixels."""

DRIVABLE = 255
_BLOCK_PIXELS = 1 << 24


@dataclass(frozen=True)
class Header:
    """What a decoded mask holds, and of which state of its source.

    Attributes:
        rows: of pixels.
        columns: of pixels.
        source_bytes: size of the PNG.
        source_mtime_ns: when the PNG was changed last.
    """

    rows: int
    columns: int
    source_bytes: int
    source_mtime_ns: int

    _FORMAT = struct.Struct("<8s4q20xI")
    _MAGIC = b"ogmmask\x02"
    SIZE = _FORMAT.size

    @classmethod
    def read(cls, path: Path) -> Self | None:
        """Read a file's header; None if it is missing, incomplete or of another version.

        Raises:
            OSError: the system refuses to read it, or it is not a regular file.
        """
        try:
            with open_file(path) as file:
                data = file.read(cls.SIZE)
                file_bytes = os.fstat(file.fileno()).st_size
        except FileNotFoundError:
            return None
        if len(data) < cls.SIZE:
            return None
        _, *fields, _ = cls._FORMAT.unpack(data)
        header = cls(*fields)
        return header if data == header.pack() and file_bytes == header._file_bytes else None

    def pack(self) -> bytes:
        """The header's bytes; they end with a checksum over themselves."""
        fields = self.rows, self.columns, self.source_bytes, self.source_mtime_ns
        checksum = zlib.crc32(self._FORMAT.pack(self._MAGIC, *fields, 0))
        return self._FORMAT.pack(self._MAGIC, *fields, checksum)

    @property
    def source_state(self) -> tuple[int, int]:
        """By which a change of the PNG is noticed."""
        return self.source_bytes, self.source_mtime_ns

    @property
    def bits_shape(self) -> tuple[int, int]:
        """(rows, bytes of a row) of the pixels."""
        return self.rows, -(-self.columns // 8)

    @property
    def checksums_at(self) -> int:
        """Where the tiles' checksums begin in the file."""
        rows, row_bytes = self.bits_shape
        return self.SIZE + rows * row_bytes

    @property
    def tiles(self) -> tuple[int, int]:
        """(rows, columns) of tiles."""
        rows, row_bytes = self.bits_shape
        return -(-rows // TILE_ROWS), -(-row_bytes // TILE_BYTES)

    @property
    def _file_bytes(self) -> int:
        rows, columns = self.tiles
        return self.checksums_at + 4 * rows * columns


def decoded_parts(image: Image, header: Header) -> Iterator[bytes]:
    """The parts of a decoded mask's file, in blocks that keep the memory beyond the decoded image small."""
    yield header.pack()
    checksums = []
    for bits in _packed_blocks(image):
        checksums += [tile_checksums(bits[row : row + TILE_ROWS]) for row in range(0, len(bits), TILE_ROWS)]
        yield bits.tobytes()
    yield np.array(checksums, "<u4").tobytes()


def tile_checksums(bits: UInt8Array) -> list[int]:
    """CRC-32 of each tile in a row of them: (TILE_ROWS or fewer, bytes) uint8."""
    starts = range(0, bits.shape[1], TILE_BYTES)
    return [zlib.crc32(bits[:, start : start + TILE_BYTES].tobytes()) for start in starts]


def read_checksums(path: Path, header: Header) -> NDArray[np.uint32]:
    """The tiles' checksums as the file has them: (rows, columns) uint32.

    Raises:
        OSError: the file can't be read.
    """
    with open_file(path) as file:
        file.seek(header.checksums_at)
        return np.frombuffer(file.read(), "<u4").reshape(header.tiles)


def _packed_blocks(image: Image) -> Iterator[UInt8Array]:
    """Rows as bits; all blocks but the last are whole rows of tiles."""
    block_rows = TILE_ROWS * max(1, _BLOCK_PIXELS // (TILE_ROWS * image.width))
    for row in range(0, image.height, block_rows):
        block = image.crop((0, row, image.width, min(row + block_rows, image.height)))
        yield np.packbits(np.asarray(block.convert("L")) == DRIVABLE, axis=1)
