"""A dataset of trainval's size: tables and four masks of real sizes, no images."""

import struct
import zlib
from pathlib import Path

import numpy as np
from big_tables import LOCATIONS, Extent, mask_name, write_tables

VERSION = "v1.0-trainval"
ROAD, BLOCK, SHIFT = 130, 700, 90
"""Widths in cells: of streets, of blocks between them, and how far a street moves from block to block."""


def write_world(root: Path, extent: Extent) -> dict[str, int]:
    """Write the tables and masks; gives the tables' row counts."""
    counts = write_tables(root, VERSION, extent)
    (root / "maps").mkdir()
    for location, (rows, columns) in LOCATIONS.items():
        write_mask(root / mask_name(location), rows, columns)
    return counts


def write_mask(path: Path, rows: int, columns: int) -> None:
    """A grey PNG of streets with bends, a block of rows at a time."""
    with path.open("wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        file.write(_chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 0, 0, 0, 0)))
        stream = zlib.compressobj(1)
        for row in range(rows):
            if row % BLOCK < ROAD:
                line = np.full(columns, 255, np.uint8)
            else:
                along = (np.arange(columns) + row // BLOCK * SHIFT + row // 8) % BLOCK
                line = np.where(along < ROAD, 255, 0).astype(np.uint8)
            file.write(_chunk(b"IDAT", stream.compress(b"\0" + line.tobytes())))
        file.write(_chunk(b"IDAT", stream.flush()) + _chunk(b"IEND", b""))


def _chunk(kind: bytes, content: bytes) -> bytes:
    if kind == b"IDAT" and not content:
        return b""
    body = kind + content
    return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))
