"""Map masks' PNG files, read whole or not at all."""

import struct
import zlib
from pathlib import Path

from PIL.Image import Image
from PIL.PngImagePlugin import PngImageFile

from ogmkit.base.files import open_file
from ogmkit.errors import DataFileError
from ogmkit.nuscenes.png_stream import require_whole_stream

_MAX_PIXELS = 1 << 31
_MAX_SIDE = 1 << 20
_END_CHECKSUM = b"\xaeB`\x82"
_UNREADABLE = (OSError, SyntaxError, ValueError, EOFError, struct.error, zlib.error)
"""What Pillow and zlib raise on bad PNGs."""


def read_grey_png(path: Path) -> Image:
    """Check a map mask to its last byte, then decode it, at one byte a pixel.

    `PngImageFile` itself, since `PIL.Image.open` refuses real masks as decompression bombs; the limits here
    take that check's place.

    Raises:
        DataFileError: the file is absent, no 8-bit greyscale or 1-bit PNG, damaged, or over 2^31 pixels.
    """
    try:
        with open_file(path) as file:
            image = PngImageFile(file)
            _check_header(path, image)
            image.verify()  # checksums of all chunks; decoding alone would forgive a missing end
            if file.read(len(_END_CHECKSUM)) != _END_CHECKSUM:
                raise DataFileError(f"{path}: map mask is cut short; restore it")
            require_whole_stream(file)
            file.seek(0)
            image = PngImageFile(file)
            image.load()
    except _UNREADABLE as error:
        raise DataFileError(f"{path}: map mask is not a whole PNG ({error}); restore it") from error
    return image


def _check_header(path: Path, image: Image) -> None:
    if image.mode not in ("L", "1"):
        raise DataFileError(
            f"{path}: map mask is a PNG of mode {image.mode}; 8-bit greyscale is needed: convert it"
        )
    if max(image.size) > _MAX_SIDE or image.width * image.height > _MAX_PIXELS:
        raise DataFileError(
            f"{path}: map mask of {image.width} × {image.height} pixels is over 2^31 in all or 2^20 a side"
        )
