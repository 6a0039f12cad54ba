"""Whether a PNG's compressed stream holds all its rows; decoders leave the rest black where it ends early."""

import struct
import zlib
from collections.abc import Iterable, Iterator
from typing import BinaryIO

_SIGNATURE_BYTES = 8
_CHUNK = struct.Struct(">I4s")
_CHECKSUM_BYTES = 4
_HEADER = struct.Struct(">IIBBBBB")
_SAMPLES = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Colour type → samples of a pixel (ISO/IEC 15948, 11.2.2)."""
_ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
"""First column and row of each interlaced pass, and the steps between (8.2)."""
_BLOCK = 1 << 20


def require_whole_stream(file: BinaryIO) -> None:
    """Inflate all of a PNG's pixels, a little at a time, and count them.

    Args:
        file: at its beginning, with a PNG whose chunks have proved whole.

    Raises:
        ValueError: there are fewer than the header says.
        zlib.error: the stream is damaged.
    """
    chunks = _chunks(file)
    header = next((data for kind, data in chunks if kind == b"IHDR"), b"")
    expected = _raw_bytes(*_HEADER.unpack(header[: _HEADER.size]))
    if not _reaches(expected, (data for kind, data in chunks if kind == b"IDAT")):
        raise ValueError("its pixels end early")


def _reaches(expected: int, pieces: Iterable[bytes]) -> bool:
    """Whether a stream inflates to so many bytes and ends, or has more; what is more is not inflated."""
    inflate, count = zlib.decompressobj(), 0
    for piece in pieces:
        count += len(inflate.decompress(piece, _BLOCK))
        while inflate.unconsumed_tail and count <= expected:
            count += len(inflate.decompress(inflate.unconsumed_tail, _BLOCK))
        if count > expected:
            return True
    count += len(inflate.flush())
    return count >= expected and inflate.eof


def _chunks(file: BinaryIO) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of each chunk, long ones in pieces."""
    file.seek(_SIGNATURE_BYTES)
    while len(head := file.read(_CHUNK.size)) == _CHUNK.size:
        length, kind = _CHUNK.unpack(head)
        while length > 0 and (data := file.read(min(length, _BLOCK))):
            length -= len(data)
            yield kind, data
        file.seek(_CHECKSUM_BYTES, 1)


def _raw_bytes(
    width: int, height: int, depth: int, colour: int, compression: int, filtering: int, interlaced: int
) -> int:
    """Bytes that the stream of such a picture inflates to: each row's filter and packed pixels."""
    del compression, filtering  # there is one of each
    bits = depth * _SAMPLES[colour]
    passes = _ADAM7 if interlaced else ((0, 0, 1, 1),)
    total = 0
    for column, row, columns, rows in passes:
        across, down = -(-(width - column) // columns), -(-(height - row) // rows)
        total += down * (1 + -(-across * bits // 8)) if across > 0 and down > 0 else 0
    return total
