"""The little of the JPEG and PNG formats that tells whether a file is whole and how large its picture is."""

import struct

from ogmkit.base.files import is_lfs_pointer

_START, _END = b"\xff\xd8", b"\xff\xd9"
# Start-of-frame markers of all coding processes; C4, C8 and CC between them mean other things (T.81, B.1).
_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}


PNG_START = b"\x89PNG\r\n\x1a\n"
PNG_END = b"IEND\xaeB`\x82"
_PNG_HEADER_BYTES = 24


def image_size(data: bytes) -> tuple[int, int]:
    """(height, width) in pixels of a whole JPEG or PNG.

    Raises:
        ValueError: the data is neither, or cut short.
    """
    return _png_size(data) if data.startswith(PNG_START) else jpeg_size(data)


def _png_size(data: bytes) -> tuple[int, int]:
    """By the header and the end (PNG, third edition, sections 5.2 and 11.2)."""
    if len(data) < _PNG_HEADER_BYTES or not data.endswith(PNG_END):
        raise ValueError("cut short")
    width, height = struct.unpack_from(">II", data, 16)
    return height, width


def jpeg_size(data: bytes) -> tuple[int, int]:
    """(height, width) in pixels of a whole JPEG (ITU-T T.81, annex B).

    Reads the headers and looks for the end marker: a hundred times faster than decoding, which on a file cut
    short only warns and fills the rest with grey. Zero bytes after the end are padding.

    Raises:
        ValueError: the data is not a JPEG, or cut short.
    """
    if not data.startswith(_START):
        if is_lfs_pointer(data):
            raise ValueError("a git-LFS pointer: run git lfs pull")
        raise ValueError("not a JPEG" if data else "empty")
    position = len(_START)
    while True:
        position, marker = _marker(data, position)
        if marker in _FRAME_MARKERS:
            break
        position += _segment_length(data, position)
    if _segment_length(data, position) < 7 or not data.rstrip(b"\0").endswith(_END):
        raise ValueError("cut short")
    height, width = struct.unpack_from(">HH", data, position + 3)
    return height, width


def _marker(data: bytes, position: int) -> tuple[int, int]:
    """The marker at a position, after any fill bytes, and where its segment begins."""
    if data[position : position + 1] not in (b"\xff", b""):
        raise ValueError("damaged between its headers")
    while data[position : position + 1] == b"\xff":
        position += 1
    if position >= len(data):
        raise ValueError("cut short")
    return position + 1, data[position]


def _segment_length(data: bytes, position: int) -> int:
    if position + 2 > len(data):
        raise ValueError("cut short")
    length = int.from_bytes(data[position : position + 2], "big")
    if position + length > len(data):
        raise ValueError("cut short")
    return length
