"""Map masks' files: greyscale PNGs as nuScenes' own, and other pictures in black and white.

White is drivable. In a greyscale PNG all but 255 is not drivable, as in the devkit. In any other PNG
(colours, a palette, transparency) each pixel is white or black, and transparent counts as black. In a JPEG,
which blurs edges, a pixel is white from 128 on, and at most one in twenty may lie between 64 and 191.
"""

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL.Image import Image, fromarray
from PIL.Image import new as new_image
from PIL.JpegImagePlugin import JpegImageFile

from ogmkit.base.files import is_lfs_pointer, open_file, read_bytes
from ogmkit.base.images import PNG_END, PNG_START, jpeg_size
from ogmkit.nuscenes.mask_faults import (
    Limit,
    cut_short,
    not_fetched,
    not_whole,
    refuse_vector_map,
    unreadable,
    unsuitable,
)
from ogmkit.nuscenes.png import COLOUR, GREY, read_colour_png, read_grey_png
from ogmkit.typing import BoolArray, UInt8Array

_JPEG = Limit("JPEG", 1 << 29)
_JPEG_START = b"\xff\xd8"
_PNG_HEADER = struct.Struct(">8x4x4sIIBB")
_HEAD_BYTES = 256
_GREYSCALE = 0
_GREY_BITS = (1, 2, 4, 8)

_BLOCK_PIXELS = 1 << 22
_WHITE, _BLACK = np.array([[255] * 4, [0, 0, 0, 255]], np.uint8).view(np.uint32).ravel()
_DARK, _HALF, _BRIGHT = 64, 128, 192
_MOST_BETWEEN = 0.05


def mask_form(path: Path) -> tuple[Limit, tuple[int, int]]:
    """Look at a mask's header and end; no pixel is decoded.

    Returns:
        The kind of file, and (height, width) in pixels.

    Raises:
        DataFileError: it is not a readable mask, is cut short, or is too large.
        OSError: the system refuses it.
    """
    refuse_vector_map(path)
    with open_file(path) as file:
        head = file.read(_HEAD_BYTES)
        file.seek(0, 2)
        file.seek(max(0, file.tell() - len(PNG_END)))
        tail = file.read()
    form, size = _jpeg_form(path) if head.startswith(_JPEG_START) else _png_form(path, head, tail)
    form.require(path, *size[::-1])
    return form, size


def read_mask(path: Path) -> Image:
    """Check a mask to its last byte, and decode it.

    Returns:
        Of mode `L` or `1`, 255 where drivable.

    Raises:
        DataFileError: it is absent, no such mask, damaged, holds more than black and white, or is too large.
    """
    try:
        form, _ = mask_form(path)
    except OSError as error:
        raise unreadable(path, error) from error
    if form is GREY:
        return read_grey_png(path)
    return _two_tones(path) if form is _JPEG else _two_colours(path)


def _png_form(path: Path, head: bytes, tail: bytes) -> tuple[Limit, tuple[int, int]]:
    if not head.startswith(PNG_START):
        if is_lfs_pointer(head):
            raise not_fetched(path)
        raise not_whole(path, "PNG or JPEG", ValueError("another kind of file" if head else "empty"))
    if len(head) < _PNG_HEADER.size or tail != PNG_END:
        raise cut_short(path)
    kind, width, height, depth, colour = _PNG_HEADER.unpack_from(head)
    if kind != b"IHDR":
        raise not_whole(path, "PNG", ValueError("its header is missing"))
    if colour == _GREYSCALE and depth not in _GREY_BITS:
        raise unsuitable(path, f"is a greyscale PNG of {depth} bits")
    return GREY if colour == _GREYSCALE else COLOUR, (height, width)


def _jpeg_form(path: Path) -> tuple[Limit, tuple[int, int]]:
    try:
        return _JPEG, jpeg_size(read_bytes(path))
    except ValueError as error:
        raise not_whole(path, "JPEG", error) from error


def _two_colours(path: Path) -> Image:
    """A PNG of any colours as greyscale, once each pixel has proved white or black."""
    image = read_colour_png(path)
    mask = new_image("L", image.size)
    for row, block in _blocks(image):
        rgba = np.asarray(block.convert("RGBA"))
        packed = rgba.view(np.uint32)[..., 0]
        white = packed == _WHITE
        other = ~(white | (packed == _BLACK) | (rgba[..., 3] == 0))
        if other.any():
            at, column = np.argwhere(other)[0]
            value = ", ".join(map(str, rgba[at, column].tolist()))
            raise unsuitable(
                path,
                f"holds other colours than black and white, such as ({value}) in row {row + at}, "
                f"column {column}",
            )
        mask.paste(_grey(white), (0, row))
    return mask


def _two_tones(path: Path) -> Image:
    """A JPEG as greyscale, once nearly all pixels have proved close to white or black."""
    image = _read_jpeg(path)
    between = 0
    for row, block in _blocks(image):
        tones = np.asarray(block)
        between += int(np.count_nonzero((tones >= _DARK) & (tones < _BRIGHT)))
        image.paste(_grey(tones >= _HALF), (0, row))
    share = between / (image.width * image.height)
    if share > _MOST_BETWEEN:
        raise unsuitable(path, f"is a JPEG with {share:.0%} of its pixels between black and white")
    return image


def _read_jpeg(path: Path) -> Image:
    """The brightness of a JPEG's pixels, mode `L`."""
    try:
        with open_file(path) as file:
            image = JpegImageFile(file)
            _JPEG.require(path, image.width, image.height)
            image.draft("L", image.size)
            image.load()
    except (SyntaxError, ValueError, OSError) as error:
        raise not_whole(path, "JPEG", error) from error
    return image if image.mode == "L" else image.convert("L")


def _blocks(image: Image) -> Iterator[tuple[int, Image]]:
    """First row and picture of blocks of rows, so that memory beside the image stays small."""
    rows = max(1, _BLOCK_PIXELS // image.width)
    for row in range(0, image.height, rows):
        yield row, image.crop((0, row, image.width, min(row + rows, image.height)))


def _grey(white: BoolArray) -> Image:
    values: UInt8Array = np.where(white, np.uint8(255), np.uint8(0))
    return fromarray(values)
