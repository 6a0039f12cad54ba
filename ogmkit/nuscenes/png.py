"""Map masks' PNG files, read whole or not at all."""

import struct
import zlib
from collections.abc import Collection
from pathlib import Path

from PIL.Image import Image
from PIL.PngImagePlugin import PngImageFile

from ogmkit.base.files import open_file
from ogmkit.nuscenes.mask_faults import Limit, cut_short, not_whole, unsuitable
from ogmkit.nuscenes.png_stream import require_whole_stream

GREY = Limit("greyscale PNG", 1 << 31)
COLOUR = Limit("colour PNG", 1 << 29)
"""Decoded, a pixel takes one byte in greyscale, and up to five otherwise."""

_END_CHECKSUM = b"\xaeB`\x82"
_UNREADABLE = (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error)
"""What Pillow and zlib raise on bad PNGs."""


def read_grey_png(path: Path) -> Image:
    """Check a map mask to its last byte, then decode it, at one byte a pixel.

    Raises:
        DataFileError: the file is absent, no greyscale PNG of 1 to 8 bits, damaged, or over 2^31 pixels.
    """
    return _read(path, ("L", "1"), GREY)


def read_colour_png(path: Path) -> Image:
    """The same of a PNG in colours, with a palette or transparency: up to 2^29 pixels, of four bytes each."""
    return _read(path, ("RGB", "RGBA", "LA", "P"), COLOUR)


def _read(path: Path, modes: Collection[str], limit: Limit) -> Image:
    """Read a PNG of some of Pillow's modes.

    `PngImageFile` itself, since `PIL.Image.open` refuses real masks as decompression bombs; the limits here
    take that check's place.
    """
    try:
        with open_file(path) as file:
            image = PngImageFile(file)
            if image.mode not in modes:
                raise unsuitable(path, f"is a PNG of mode {image.mode}")
            limit.require(path, image.width, image.height)
            image.verify()  # checksums of all chunks; decoding alone would forgive a missing end
            if file.read(len(_END_CHECKSUM)) != _END_CHECKSUM:
                raise cut_short(path)
            require_whole_stream(file)
            file.seek(0)
            image = PngImageFile(file)
            image.load()
    except _UNREADABLE as error:
        raise not_whole(path, "PNG", error) from error
    return image
