"""Arithmetic on colour images that is slow when left to broadcasting over three channels."""

import cv2
import numpy as np

from ogmkit.synthetic.palette import Palette
from ogmkit.typing import Float32Array


def three_channels(plane: Float32Array) -> Float32Array:
    """(h, w, 3) with the plane (h, w) in each channel."""
    return np.asarray(cv2.merge((plane, plane, plane)), dtype=np.float32)


def blend(target: Float32Array, colour: Float32Array, share: Float32Array) -> None:
    """Move the target (h, w, 3) in place towards a colour of the same shape by a share (h, w)."""
    target += three_channels(share) * (colour - target)


def hazed(colour: Float32Array, depth: Float32Array, palette: Palette) -> Float32Array:
    """Colours (h, w, 3) seen through (h, w) metres of air."""
    seen = np.empty_like(colour)
    seen[:] = np.array(palette.sky_horizon_bgr, np.float32)
    blend(seen, colour, np.exp(depth * np.float32(-1 / palette.haze_m)))
    return seen
