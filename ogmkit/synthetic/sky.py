"""Sky with clouds and sun, and a skyline of far hills."""

import cv2
import numpy as np

from ogmkit.synthetic.ground_texture import grain_tile, sample_tile
from ogmkit.synthetic.palette import Palette
from ogmkit.synthetic.view import View
from ogmkit.typing import Float32Array, FloatArray

_REDUCTION = 4
_CLOUD_CELLS, _CLOUD_SCALES_PX = 60.0, (2.0, 6.0, 20.0)
# Per ridge, far to near: mean height and swing as slopes, share of haze, highest frequency round the horizon.
_RIDGES = ((0.030, 0.012, 0.75, 24), (0.016, 0.005, 0.5, 160))
_RIDGE_BGR = (62.0, 84.0, 70.0)


def draw_sky(palette: Palette, view: View) -> Float32Array:
    """The whole image (h, w, 3) as if there were no ground."""
    height_px, width_px = view.image_size
    # The sky is smooth: every fourth pixel is enough. Pixel i of the reduced image lies at 4·i + 1.5.
    rows, columns = (
        np.arange((_REDUCTION - 1) / 2, size + _REDUCTION, _REDUCTION, dtype=np.float64)
        for size in view.image_size
    )
    small = _air(palette, view.directions(rows, columns))
    enlarged = cv2.resize(small, None, fx=_REDUCTION, fy=_REDUCTION, interpolation=cv2.INTER_LINEAR)
    image = np.array(enlarged[:height_px, :width_px], dtype=np.float32)
    _draw_ridges(image, palette, view)
    return image


def _air(palette: Palette, directions: Float32Array) -> Float32Array:
    """Sky colours along rays (3, h, w): gradient, clouds and the sun's glow."""
    unit = directions / np.sqrt((directions**2).sum(axis=0))
    up = np.clip(unit[2], 0, 1)
    zenith, horizon = (np.array(bgr, np.float32) for bgr in (palette.sky_zenith_bgr, palette.sky_horizon_bgr))
    colour = horizon + (1 - np.exp(-4.5 * up))[..., None] * (zenith - horizon)
    tile = grain_tile(palette.texture_seed + 3, _CLOUD_SCALES_PX)
    columns, rows = (np.float32(_CLOUD_CELLS) * unit[axis] / (up + np.float32(0.12)) for axis in (0, 1))
    cloud = sample_tile(tile, columns, rows)
    cover = np.clip(2.6 * cloud, 0, 1) * np.clip(up * 6, 0, 1)
    colour += cover[..., None] * np.float32(0.75) * (np.float32(246) - colour)
    towards_sun = np.clip(np.tensordot(np.array(palette.sun_direction, np.float32), unit, 1), 0, 1)
    glow = palette.sun_strength * (0.35 * towards_sun**12 + 0.9 * towards_sun**400)
    colour += glow[..., None] * (np.array([214.0, 240.0, 255.0]) - colour)
    return np.asarray(colour, dtype=np.float32)


def _draw_ridges(image: Float32Array, palette: Palette, view: View) -> None:
    """Paint the skyline in place."""
    rows = _rows_near_horizon(view)
    if len(rows) == 0:
        return
    directions = view.directions(rows, np.arange(view.image_size[1], dtype=np.float64))
    horizontal, azimuth = cv2.cartToPolar(directions[0], directions[1])
    slope = directions[2] / horizontal
    focal = np.float32(view.intrinsics[0, 0])
    haze = np.array(palette.sky_horizon_bgr, np.float32)
    window = image[int(rows[0]) : int(rows[-1]) + 1]
    for index, (mean, swing, hazy, frequency) in enumerate(_RIDGES):
        outline = _ridge(palette.texture_seed + index, frequency)
        height = mean + swing * np.interp(azimuth, np.linspace(0, 2 * np.pi, len(outline)), outline)
        cover = np.clip((height.astype(np.float32) - slope) * focal + np.float32(0.5), 0, 1)[..., None]
        window += cover * (hazy * haze + (1 - hazy) * np.array(_RIDGE_BGR, np.float32) - window)


def _rows_near_horizon(view: View) -> FloatArray:
    """Image rows in which some ray's slope is that of a ridge or of the far ground below it."""
    height_px, width_px = view.image_size
    rows = np.arange(height_px, dtype=np.float64)
    directions = view.directions(rows, np.linspace(0, width_px - 1.0, 5))
    slope = directions[2] / np.hypot(directions[0], directions[1])
    near: FloatArray = rows[((slope > -0.02) & (slope < 0.06)).any(axis=1)]
    return near


def _ridge(seed: int, highest_frequency: int) -> FloatArray:
    """A closed outline round the horizon, about −1 to 1: sines of falling weight."""
    random = np.random.Generator(np.random.PCG64(seed))
    azimuth = np.linspace(0, 2 * np.pi, 2049)
    frequencies = np.unique(np.geomspace(3, highest_frequency, 12).astype(int))
    weights = frequencies**-0.6
    phases = random.uniform(0, 2 * np.pi, len(frequencies))
    outline: FloatArray = (
        np.sin(np.outer(azimuth, frequencies) + phases) @ weights / np.sqrt((weights**2).sum())
    )
    return outline
