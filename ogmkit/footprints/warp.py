"""Masks between camera and BEV by a homography, the paper's way."""

import cv2
import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.homography.projective import inverse_or_nan
from ogmkit.typing import FloatArray, IntArray, UInt8Array

_MAX_SIDE = 32_766  # what OpenCV 4 warps


def warp_to_image(
    mask_bev: UInt8Array, bev_from_image: FloatArray, image_size: tuple[int, int]
) -> UInt8Array:
    """Lay a BEV mask on the image by a homography: the paper's training masks (footprint segmentation).

    Above the horizon (w ≤ 0) there is no ground, though the homography gives cells there, too.

    Args:
        mask_bev: (rows, columns) uint8 0/1.
        bev_from_image: (3, 3), w > 0 for ground in front of the camera; of the pixels of this size.
        image_size: (height, width) of the result.

    Returns:
        (height, width) uint8 0/1; the nearest cell's value.

    Raises:
        SettingsError: the homography is not finite, or the mask is too long for OpenCV.
    """
    return _warp(mask_bev, bev_from_image, image_size)


def warp_to_bev(mask_image: UInt8Array, bev_from_image: FloatArray, shape: tuple[int, int]) -> UInt8Array:
    """Lay a camera-view mask on the grid by a homography.

    Cells behind the camera, whose pixel would be above the horizon, are 0.

    Args:
        mask_image: (height, width) uint8.
        bev_from_image: (3, 3), of the mask's pixels.
        shape: (rows, columns) of the grid.

    Returns:
        (rows, columns) uint8; the nearest pixel's value.

    Raises:
        SettingsError: as `warp_to_image`, or the homography is singular.
    """
    _require_finite(bev_from_image)
    # The third coordinate of the inverse is 1/w: of the same sign.
    image_from_bev = inverse_or_nan(bev_from_image[None])[0]
    if not np.isfinite(image_from_bev).all():
        raise SettingsError("the homography is singular")
    return _warp(mask_image, image_from_bev, shape)


def require_warpable(shape: tuple[int, ...]) -> None:
    """Refuse (rows, columns) of masks that OpenCV 4 does not warp.

    Raises:
        SettingsError: a side is too long.
    """
    if max(shape) > _MAX_SIDE:
        rows, columns = shape
        raise SettingsError(
            f"{rows} rows × {columns} columns are too many to be warped: at most {_MAX_SIDE} on a side"
        )


def _warp(source: UInt8Array, source_from_result: FloatArray, size: tuple[int, int]) -> UInt8Array:
    """The source's nearest value wherever w > 0; only rows that have such a place are worked on."""
    _require_finite(source_from_result)
    require_warpable(source.shape)
    height, width = size
    result = np.zeros(size, np.uint8)
    w_at_ends = _w(source_from_result, np.arange(height), np.array([0, width - 1]))
    rows = np.flatnonzero((w_at_ends > 0).any(axis=1))
    if not len(rows):
        return result
    first, stop = int(rows[0]), int(rows[-1]) + 1  # w is linear: all rows between have such places, too
    source_from_strip = source_from_result @ np.array([[1.0, 0, 0], [0, 1, first], [0, 0, 1]])
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    cv2.warpPerspective(source, source_from_strip, (width, stop - first), dst=result[first:stop], flags=flags)
    cut = rows[(w_at_ends[rows] <= 0).any(axis=1)]
    result[cut] *= _w(source_from_result, cut, np.arange(width)) > 0
    return result


def _w(homography: FloatArray, rows: IntArray, columns: IntArray) -> FloatArray:
    """(rows, columns) third homogeneous coordinates; w > 0 is before the camera."""
    along_column, along_row, offset = homography[2]
    w: FloatArray = along_column * columns + (along_row * rows + offset)[:, None]
    return w


def _require_finite(homography: FloatArray) -> None:
    if not np.isfinite(homography).all():
        raise SettingsError("the homography holds a number that is not finite")
