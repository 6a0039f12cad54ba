"""Decoding images at the size that is wanted."""

from math import gcd

import cv2
import numpy as np

from ogmkit.base.images import PNG_START, image_size
from ogmkit.errors import DataFileError
from ogmkit.typing import UInt8Array

# The orientation that a camera may note in EXIF is not the calibrated image's business.
_DECODE = {
    factor: flag | cv2.IMREAD_IGNORE_ORIENTATION
    for factor, flag in (
        (8, cv2.IMREAD_REDUCED_COLOR_8),
        (4, cv2.IMREAD_REDUCED_COLOR_4),
        (2, cv2.IMREAD_REDUCED_COLOR_2),
        (1, cv2.IMREAD_COLOR),
    )
}
"""By what the size is divided while decoding; the largest first."""
IMAGENET_STATISTICS = {"mean": (0.485, 0.456, 0.406), "std": (0.229, 0.224, 0.225)}
"""Of red, green and blue, 0 … 1: what encoders that learnt on ImageNet are given images by."""
_ALIKE = 1.05
"""Where pixels grow by no more than this, linear weights are areas' to within the same share, and faster."""


def decode_resized(
    data: UInt8Array, source_size: tuple[int, int], size: tuple[int, int], place: str
) -> UInt8Array:
    """Decode a JPEG or PNG and resize it, corners on corners (`ogmkit.geometry.camera.image_from_resized`).

    Where much smaller than the file, a JPEG is decoded at a half, a quarter or an eighth, several times
    faster.

    Args:
        data: the file's bytes, (n,) uint8.
        source_size: (height, width) that the image must have.
        size: (height, width) of the result.
        place: where the image stands, for messages.

    Returns:
        (h, w, 3) uint8 RGB.

    Raises:
        DataFileError: the file is damaged or of another size.
    """
    whole = data.tobytes()
    _require_whole(whole, source_size, place)
    factor = 1 if whole.startswith(PNG_START) else _reduction(source_size, size)
    image = cv2.imdecode(np.asarray(data), _DECODE[factor])
    expected = tuple(-(-side // factor) for side in source_size)
    if image is None or image.shape[:2] != expected:
        raise DataFileError(f"{place}: image can't be decoded; restore the dataset, then `ogmkit extract`")
    return resized(_within(np.asarray(image, dtype=np.uint8), source_size, factor), size)


def resized(bgr: UInt8Array, size: tuple[int, int]) -> UInt8Array:
    """(h, w, 3) BGR pixels as OpenCV has them at another (height, width), corners on corners, in RGB."""
    if size != bgr.shape[:2]:
        growth = tuple(side / wanted for side, wanted in zip(bgr.shape[:2], size, strict=True))  # of pixels
        way = cv2.INTER_AREA if min(growth) >= 1 and max(growth) > _ALIKE else cv2.INTER_LINEAR
        bgr = np.asarray(cv2.resize(bgr, size[::-1], interpolation=way), dtype=np.uint8)
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def _require_whole(data: bytes, source_size: tuple[int, int], place: str) -> None:
    """Refuse what the decoder would only warn of: it fills up a file that was cut short."""
    try:
        found = image_size(data)
    except ValueError as error:
        raise DataFileError(
            f"{place}: image is not a whole JPEG or PNG ({error}); restore the dataset, then `ogmkit extract`"
        ) from error
    if found != source_size:
        (height, width), (rows, columns) = found, source_size
        raise DataFileError(
            f"{place}: image is {width} × {height} pixels, by its record {columns} × {rows}; "
            "restore the dataset, then `ogmkit extract`"
        )


def _reduction(source_size: tuple[int, int], size: tuple[int, int]) -> int:
    """The largest division while decoding that leaves no less than is wanted."""
    return next(
        factor
        for factor in _DECODE
        if factor == 1 or all(side >= factor * wanted for side, wanted in zip(source_size, size, strict=True))
    )


def _within(reduced: UInt8Array, source_size: tuple[int, int], factor: int) -> UInt8Array:
    """Cut off what a reduced image's last pixels show beyond the source, so that corners are on corners.

    Where the factor does not divide a side, its pixels are split into as many equal ones as let it end on
    an edge.
    """
    for axis, side in enumerate(source_size):
        if side % factor:
            parts = factor // gcd(side, factor)
            reduced = reduced.repeat(parts, axis=axis).take(range(side * parts // factor), axis=axis)
    return reduced
