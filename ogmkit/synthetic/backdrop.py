"""Sky and textured ground: everything but the solids."""

from itertools import groupby

import cv2
import numpy as np

from ogmkit.synthetic.blending import hazed, three_channels
from ogmkit.synthetic.ground_texture import CELL_M, grain_tile, sample_tile
from ogmkit.synthetic.palette import Palette
from ogmkit.synthetic.scenery import Scenery
from ogmkit.synthetic.sky import draw_sky
from ogmkit.synthetic.terrain import FARTHEST_M, depth_from_inverse
from ogmkit.synthetic.view import View
from ogmkit.typing import Float32Array

_MOST_SAMPLES = 8
# The ground's raster is coarse for what lies right before the camera: finer grain is added and fades out.
_FINE_CELL_M, _FINE_REACH_M, _FINE_CONTRAST = 0.012, 14.0, 0.4


def draw_backdrop(scenery: Scenery, view: View) -> tuple[Float32Array, Float32Array]:
    """Draw sky and ground.

    Returns:
        (h, w, 3) float32 BGR and (h, w) 1/depth of the ground in 1/m, 0 or less in the sky.
    """
    height_px, width_px = view.image_size
    columns = np.arange(width_px, dtype=np.float64)
    inverse_depth = view.ground_inverse_depth(
        view.directions(np.arange(height_px, dtype=np.float64), columns)
    )
    image = draw_sky(scenery.palette, view)
    grounded = inverse_depth > 1 / FARTHEST_M
    rows = np.flatnonzero(grounded.any(axis=1)).tolist()
    for (samples, cell_m), band in groupby(rows, key=lambda row: _sampling(view, inverse_depth[row])):
        first, *rest = band
        window = slice(first, (rest[-1] if rest else first) + 1)
        depth = depth_from_inverse(inverse_depth[window])
        colour = hazed(_ground(scenery, view, window, samples, cell_m), depth, scenery.palette)
        np.copyto(image[window], colour, where=grounded[window, :, None])
    return image, inverse_depth


def _sampling(view: View, inverse_depth: Float32Array) -> tuple[int, float]:
    """How to average the ground over the pixels of a row: samples along v, and the raster's cell size.

    Seen at a slant, a pixel covers depth / height times more ground along the view than across it.
    """
    depth = min(1 / max(float(inverse_depth[len(inverse_depth) // 2]), 1e-9), FARTHEST_M)
    across_m = depth / view.intrinsics[0, 0]
    along_m = across_m * max(depth / view.height_above_ground_m, 1.0)
    wanted = np.round(np.log2(along_m / max(across_m, CELL_M)))
    samples = 2 ** int(np.clip(wanted, 0, np.log2(_MOST_SAMPLES)))
    return samples, float(2.0 ** np.round(np.log2(max(across_m, along_m / samples))))


def _ground(scenery: Scenery, view: View, window: slice, samples: int, cell_m: float) -> Float32Array:
    """Colours of the ground in some rows of the image."""
    height_px, width_px = window.stop - window.start, view.image_size[1]
    rows = window.start + (np.arange(height_px * samples) + 0.5) / samples - 0.5
    directions = view.directions(rows, np.arange(width_px, dtype=np.float64))
    depth = depth_from_inverse(view.ground_inverse_depth(directions))
    x, y = (directions[axis] * depth + np.float32(view.origin[axis]) for axis in (0, 1))
    colour = scenery.texture.sample(x, y, cell_m)
    if samples > 1:
        resized = cv2.resize(colour, (width_px, height_px), interpolation=cv2.INTER_AREA)
        return np.asarray(resized, dtype=np.float32)
    return colour * three_channels(_fine_grain(x, y, depth, scenery.palette))


def _fine_grain(x: Float32Array, y: Float32Array, depth: Float32Array, palette: Palette) -> Float32Array:
    """Brightness factor (h, w) near the camera."""
    tile = grain_tile(palette.texture_seed + 2)
    grain = sample_tile(tile, x / np.float32(_FINE_CELL_M), y / np.float32(_FINE_CELL_M))
    contrast = np.maximum(1 - depth / np.float32(_FINE_REACH_M), 0) * np.float32(_FINE_CONTRAST)
    return np.asarray(1 + contrast * grain, dtype=np.float32)
