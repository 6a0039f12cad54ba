"""Rasters as PNG files: values as they are, of 8 or 16 bits."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

_SETTINGS = (cv2.IMWRITE_PNG_COMPRESSION, 4)


def png_of(raster: NDArray[Any]) -> bytes:
    """(h, w) uint8 or uint16 as a PNG of one channel; 0/1 masks stay 0 and 1, which viewers show as black."""
    _, data = cv2.imencode(".png", np.ascontiguousarray(raster), _SETTINGS)
    return data.tobytes()
