"""Random windows of images: what a camera of a longer focal length would see, turned a little."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ogmkit.samples.arrays import SampleArrays, scaled
from ogmkit.typing import FloatArray, IntArray, UInt8Array


def cropped(sample: SampleArrays, side: float, left: float, top: float) -> SampleArrays:
    """The sample with each image's window enlarged to the whole image; the world stays where it is.

    Args:
        sample: is left as it is.
        side: of the window, as a share of the image's, 0 … 1.
        left: place of the window, as a share of what is left of the width, 0 … 1.
        top: the same of the height.
    """
    windows = [_image_from_window(size, side, left, top) for size in sample.image_size]
    image_from_window = np.stack(windows)
    changes: dict[str, NDArray[np.generic]] = {}
    if sample.image is not None:
        changes["image"] = np.stack(
            [
                _seen(image, window, cv2.INTER_LINEAR)
                for image, window in zip(sample.image, windows, strict=True)
            ]
        )
    if sample.masks is not None:
        pairs = zip(sample.masks, windows, strict=True)
        changes["masks"] = np.stack(
            [[_seen(mask, window, cv2.INTER_NEAREST) for mask in masks] for masks, window in pairs]
        )
    if sample.bev_from_image is not None:
        changes["bev_from_image"] = scaled(sample.bev_from_image @ image_from_window)
    if sample.intrinsics is not None:
        changes["intrinsics"] = np.linalg.inv(image_from_window) @ sample.intrinsics
    return replace(sample, **changes)  # type: ignore[arg-type]  # each of its own dtype


def _image_from_window(image_size: IntArray, side: float, left: float, top: float) -> FloatArray:
    """(3, 3) pixels of the image from pixels of the enlarged window, whose corners lie on its own."""
    height, width = image_size
    shift = (side - 1) / 2
    u, v = (1 - side) * left * width, (1 - side) * top * height
    return np.array([[side, 0.0, u + shift], [0.0, side, v + shift], [0.0, 0.0, 1.0]])


def _seen(picture: UInt8Array, image_from_window: FloatArray, interpolation: int) -> UInt8Array:
    """(h, w[, C]) picture through the window; its outermost half pixels have their neighbours' values."""
    size = picture.shape[1], picture.shape[0]
    flags = interpolation | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpAffine(picture, image_from_window[:2], size, flags=flags, borderMode=cv2.BORDER_REPLICATE),
        np.uint8,
    )
