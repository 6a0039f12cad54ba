"""The ground seen from above: a raster with reduced copies, drawn once per scene."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from shapely.geometry import Polygon

from ogmkit.synthetic.ground import GroundLayers, HeightFunction, kerbs, markings, polygons
from ogmkit.synthetic.palette import Palette
from ogmkit.typing import Float32Array, FloatArray, UInt8Array

CELL_M = 0.05
LONGEST_M = 1500.0
"""OpenCV's `remap` takes rasters of at most 32,767 cells a side."""
_LEVELS = 7
_TILE_PX = 512
_SHIFT = 4
# Share of the grain's full contrast that each material shows.
_ROUGHNESS = {"grass": 255, "asphalt": 80, "walkway": 55, "kerb": 40, "island": 200, "marking": 50}


@dataclass(frozen=True, eq=False)
class GroundTexture:
    """The textured ground and its successively halved copies.

    Attributes:
        levels: BGR rasters; level k has cells of `CELL_M`·2^k. Rows run north, columns east.
        origin: x, y of the south-western corner, `global` metres.
    """

    levels: tuple[UInt8Array, ...]
    origin: tuple[float, float]

    def sample(self, x: FloatArray | Float32Array, y: FloatArray | Float32Array, cell_m: float) -> UInt8Array:
        """Colours (..., 3) at `global` (H, W) positions, averaged over about `cell_m`."""
        level = int(np.clip(np.round(np.log2(max(cell_m, CELL_M) / CELL_M)), 0, len(self.levels) - 1))
        scale = 1 / (CELL_M * 2**level)
        columns = ((x - self.origin[0]) * scale - 0.5).astype(np.float32, copy=False)
        rows = ((y - self.origin[1]) * scale - 0.5).astype(np.float32, copy=False)
        level_bgr = self.levels[level]
        sampled = cv2.remap(level_bgr, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(sampled, dtype=np.uint8)

    def brightness(self, points_xy: FloatArray) -> FloatArray:
        """Mean of the colours (P,) at `global` (P, 2) positions, from 0 to 255; outside that of the rim."""
        raster = self.levels[0]
        cells = np.floor((points_xy - self.origin) / CELL_M)
        columns, rows = np.clip(cells, 0, (raster.shape[1] - 1, raster.shape[0] - 1)).astype(np.int64).T
        return np.asarray(raster[rows, columns].mean(axis=-1), dtype=np.float64)


def draw_texture(
    layers: GroundLayers,
    palette: Palette,
    extent: tuple[float, float, float, float],
    height: HeightFunction | None,
) -> GroundTexture:
    """Paint the layers in full light, with grain and, where there is relief, shaded slopes.

    Args:
        layers: what to paint.
        palette: colours, sun, and the grain's seed.
        extent: x_min, y_min, x_max, y_max in `global` metres.
        height: ground height in metres at (..., 2) positions, or None for flat ground.
    """
    multiple = 2 ** (_LEVELS - 1)
    columns, rows = (
        int(np.ceil((extent[axis + 2] - extent[axis]) / CELL_M / multiple)) * multiple for axis in (0, 1)
    )
    colour = np.empty((rows, columns, 3), np.uint8)
    colour[:] = np.uint8(np.round(palette.grass_bgr))
    roughness = np.full((rows, columns), _ROUGHNESS["grass"], np.uint8)
    kerb_bgr = tuple(1.18 * value for value in palette.walkway_bgr)
    for material, shapes, bgr in (
        ("walkway", polygons(layers.walkway), palette.walkway_bgr),
        ("asphalt", polygons(layers.drivable), palette.asphalt_bgr),
        ("marking", markings(layers), palette.marking_bgr),
        ("island", polygons(layers.islands), palette.grass_bgr),
        ("kerb", kerbs(layers), kerb_bgr),
    ):
        _paint(colour, roughness, shapes, bgr, _ROUGHNESS[material], extent[:2])
    _apply_grain(colour, roughness, palette, _shading(palette, extent[:2], (rows, columns), height))
    levels: list[UInt8Array] = [colour]
    for _ in range(_LEVELS - 1):
        halved = cv2.resize(levels[-1], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        levels.append(np.asarray(halved, dtype=np.uint8))
    return GroundTexture(tuple(levels), (extent[0], extent[1]))


@cache
def grain_tile(seed: int, scales_px: tuple[float, ...] = (0.0, 1.5, 6.0, 32.0)) -> UInt8Array:
    """A seamless square of grey noise around 128, with equal shares of structure of the given sizes."""
    random = np.random.Generator(np.random.PCG64(seed))
    total = np.zeros((_TILE_PX, _TILE_PX), np.float32)
    for scale_px in scales_px:
        noise = random.standard_normal((_TILE_PX, _TILE_PX), dtype=np.float32)
        if scale_px > 0:
            # OpenCV's blur can't wrap round, so pad by hand to keep the tile seamless.
            margin = int(4 * scale_px)
            padded = np.pad(noise, margin, mode="wrap")
            blurred = cv2.GaussianBlur(padded, (0, 0), scale_px)
            noise = np.asarray(blurred[margin:-margin, margin:-margin], dtype=np.float32)
        total += noise / noise.std()
    tile: UInt8Array = np.clip(128 + 30 / np.sqrt(len(scales_px)) * total, 0, 255).astype(np.uint8)
    # Cached, so shared by all callers.
    tile.setflags(write=False)
    return tile


def sample_tile(tile: UInt8Array, columns: Float32Array, rows: Float32Array) -> Float32Array:
    """The endlessly repeated tile at array positions (h, w), from −1 to 1."""
    size = np.float32(_TILE_PX)
    sampled = cv2.remap(
        tile, np.mod(columns, size), np.mod(rows, size), cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP
    )
    return (sampled.astype(np.float32) - 128) / np.float32(128)


def _paint(
    colour: UInt8Array,
    roughness: UInt8Array,
    shapes: Iterable[Polygon],
    bgr: tuple[float, ...],
    rough: int,
    origin: tuple[float, float],
) -> None:
    for polygon in shapes:
        rings = [
            np.round(((np.asarray(ring.coords)[:, :2] - origin) / CELL_M - 0.5) * 2**_SHIFT).astype(np.int32)
            for ring in (polygon.exterior, *polygon.interiors)
        ]
        cv2.fillPoly(colour, rings, bgr, cv2.LINE_AA, _SHIFT)
        cv2.fillPoly(roughness, rings, (rough,), cv2.LINE_AA, _SHIFT)


def _shading(
    palette: Palette,
    origin: tuple[float, float],
    shape: tuple[int, int],
    height: HeightFunction | None,
) -> Float32Array:
    """Brightness per cell of 2.56 m: broad stains, and how each slope faces the sun; 1 = flat and clean."""
    step_m = CELL_M * _TILE_PX / 10
    rows, columns = (int(np.ceil(cells * CELL_M / step_m)) + 1 for cells in shape)
    random = np.random.Generator(np.random.PCG64(palette.texture_seed + 1))
    shading: FloatArray = 1 + 0.035 * random.standard_normal((rows, columns))
    if height is not None:
        x, y = origin[0] + step_m * np.arange(columns), origin[1] + step_m * np.arange(rows)
        slope_y, slope_x = np.gradient(height(np.stack(np.meshgrid(x, y), axis=-1)), step_m)
        sun_x, sun_y, sun_z = palette.sun_direction
        facing = (sun_z - sun_x * slope_x - sun_y * slope_y) / np.sqrt(1 + slope_x**2 + slope_y**2) / sun_z
        shading *= 1 + palette.sun_strength * (facing - 1)
    return shading.astype(np.float32)


def _apply_grain(colour: UInt8Array, roughness: UInt8Array, palette: Palette, shading: Float32Array) -> None:
    """Multiply the colours by grain and shading in place, tile by tile to bound the memory."""
    grain = (grain_tile(palette.texture_seed).astype(np.float32) - 128) / 128 / 255
    for row in range(0, colour.shape[0], _TILE_PX):
        for column in range(0, colour.shape[1], _TILE_PX):
            tile = colour[row : row + _TILE_PX, column : column + _TILE_PX]
            rows, columns = tile.shape[:2]
            coarse_row, coarse_column = 10 * row // _TILE_PX, 10 * column // _TILE_PX
            broad = cv2.warpAffine(
                shading[coarse_row : coarse_row + 12, coarse_column : coarse_column + 12],
                np.array([[10 / _TILE_PX, 0, 5 / _TILE_PX], [0, 10 / _TILE_PX, 5 / _TILE_PX]]),
                (columns, rows),
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
                borderMode=cv2.BORDER_REPLICATE,
            )
            factor = broad + grain[:rows, :columns] * roughness[row : row + rows, column : column + columns]
            cv2.multiply(tile, cv2.merge([factor] * 3), dst=tile, dtype=cv2.CV_8U)
