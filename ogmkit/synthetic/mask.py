"""The raster of a map: 8-bit PNG, 0.1 m a pixel, north up."""

from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from shapely import MultiPolygon

from ogmkit.errors import OutputError
from ogmkit.typing import FloatArray, UInt8Array

PIXELS_PER_M = 10


def rasterise(areas: MultiPolygon, size_m: tuple[float, float]) -> UInt8Array:
    """Pixels whose centre lies inside, by the even-odd rule.

    Pixel (row, column) has its centre at x = column / 10, y = (height − row) / 10: the devkit's rule
    (`MapMask.to_pixel_coords`; design.md §1).

    Args:
        areas: polygons in `global` metres.
        size_m: width and height of the map.

    Returns:
        (rows, columns) uint8, 255 inside and 0 outside.
    """
    columns, rows = (round(size * PIXELS_PER_M) for size in size_m)
    toggles = np.zeros((rows, columns + 1), dtype=np.uint8)
    for polygon in areas.geoms:
        for ring in (polygon.exterior, *polygon.interiors):
            points = np.asarray(ring.coords) * PIXELS_PER_M
            _toggle(toggles, np.column_stack([points[:, 0], rows - points[:, 1]]))
    inside = np.bitwise_xor.accumulate(toggles[:, :columns], axis=1)
    return inside * np.uint8(255)


def write_mask(path: Path, areas: MultiPolygon, size_m: tuple[float, float]) -> None:
    """Write the mask of a map.

    Raises:
        OutputError: the file can't be written.
    """
    if not cv2.imwrite(str(path), rasterise(areas, size_m), [cv2.IMWRITE_PNG_COMPRESSION, 9]):
        raise OutputError(f"{path}: the map mask can't be written; check space and permissions")


def _toggle(toggles: UInt8Array, ring: FloatArray) -> None:
    """Flip the first pixel centre at or right of every crossing of a closed ring with a row of centres."""
    for (x0, y0), (x1, y1) in pairwise(ring):
        low, high = sorted((y0, y1))
        rows = np.arange(max(int(np.ceil(low)), 0), min(int(np.ceil(high)), len(toggles)))
        if len(rows):
            crossings = x0 + (rows - y0) * (x1 - x0) / (y1 - y0)
            columns = np.clip(np.ceil(crossings), 0, toggles.shape[1] - 1).astype(np.int64)
            toggles[rows, columns] ^= 1
