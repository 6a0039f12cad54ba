"""What covers the faces of boxes: small textures of paint, glass, wheels, lamps, windows and leaves."""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from ogmkit.synthetic.ground_texture import grain_tile
from ogmkit.typing import Float32Array, FloatArray

Polygon = tuple[tuple[float, float], ...]

_GLASS, _TYRE, _DARK = (74.0, 62.0, 52.0), (34.0, 34.0, 36.0), (48.0, 48.0, 50.0)
_HEADLAMP, _TAILLAMP, _PLATE, _WHITE = (
    (236.0, 244.0, 248.0),
    (42.0, 36.0, 190.0),
    (214.0, 220.0, 222.0),
    (238.0,) * 3,
)
_BACKING = (150.0, 152.0, 154.0)
_SKIN, _TROUSERS = (140.0, 170.0, 212.0), (84.0, 66.0, 58.0)
_HEIGHT_PX = 384
_GRAIN_SEED, _LEAF_SCALES_PX = 20, (3.0, 8.0, 24.0)


@dataclass(frozen=True, eq=False)
class Facade:
    """The look of one face, seen from outside, upright; the top face has the front upwards.

    Attributes:
        overlay_bgr: (H, W, 3) colours that don't depend on the solid's paint, times their opacity.
        opacity: (H, W) share of the overlay, 0 to 1; the rest shows the paint.
        shade: (H, W) brightness factor of the paint.
        repeat_m: width and height in metres of one copy on large faces, or None where it covers the face.
    """

    overlay_bgr: Float32Array
    opacity: Float32Array
    shade: Float32Array
    repeat_m: tuple[float, float] | None = None

    def painted(self, colour_bgr: FloatArray) -> Float32Array:
        """(H, W, 3) colours on a solid of the given paint, in full light."""
        paint = (self.shade * (1 - self.opacity))[..., None] * colour_bgr.astype(np.float32)
        return np.asarray(self.overlay_bgr + paint, dtype=np.float32)


@cache
def facade(look: str, face: int) -> tuple[Facade, ...]:
    """The texture of a face and its successively halved copies.

    Args:
        look: a name from `parts.Parts.look`.
        face: 0 front, 1 back, 2 left, 3 right, 4 top, 5 bottom.
    """
    # Drawn at twice the size and halved, so that edges are smooth.
    levels = [_halved(_draw(look, face))]
    while min(levels[-1].opacity.shape) > 4:
        levels.append(_halved(levels[-1]))
    return tuple(levels)


def _halved(last: Facade) -> Facade:
    overlay, opacity, shade = (
        np.asarray(cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), dtype=np.float32)
        for image in (last.overlay_bgr, last.opacity, last.shade)
    )
    return Facade(overlay, opacity, shade, last.repeat_m)


def _draw(look: str, face: int) -> Facade:
    if look == "building":
        return _building(face)
    if look == "leaves":
        return _leaves()
    side = face in (2, 3)
    canvas = _Canvas(2 if side else 1)
    drawing = {
        "car": _car,
        "large": _large,
        "two-wheeler": _two_wheeler,
        "person": _person,
        "cone": _cone,
    }.get(look)
    if drawing is not None:
        drawing(canvas, face)
    elif look == "barrier" and face < 4:
        canvas.stripes(_WHITE)
    # A right-hand side is the left-hand one mirrored: the drawings have the front on the left.
    return canvas.facade(mirrored=face == 3)


class _Canvas:
    """A face to draw on, in coordinates from 0 to 1: right and down."""

    def __init__(self, aspect: int) -> None:
        shape = (_HEIGHT_PX, _HEIGHT_PX * aspect)
        self._overlay = np.zeros((*shape, 3), np.float32)
        self._opacity = np.zeros(shape, np.float32)
        self._shade = np.repeat(
            np.linspace(1.06, 0.86, shape[0], dtype=np.float32)[:, None], shape[1], axis=1
        )
        self._scale = np.array([shape[1], shape[0]])

    def polygon(self, corners: Polygon, bgr: tuple[float, ...] | None) -> None:
        """Fill with a colour, or with the solid's paint where it is None."""
        points = np.round((np.array(corners) * self._scale - 0.5) * 16).astype(np.int32)
        cv2.fillPoly(self._overlay, [points], bgr or (0.0,), cv2.LINE_8, 4)
        cv2.fillPoly(self._opacity, [points], (float(bgr is not None),), cv2.LINE_8, 4)

    def rectangle(self, left: float, top: float, right: float, bottom: float, bgr: tuple[float, ...]) -> None:
        self.polygon(((left, top), (right, top), (right, bottom), (left, bottom)), bgr)

    def wheel(self, centre: float, width: float, height: float) -> None:
        for share, bgr in ((1.0, _TYRE), (0.55, (150.0, 150.0, 150.0)), (0.2, _DARK)):
            angles = np.linspace(0, 2 * np.pi, 25)[:-1]
            x = centre + share * width / 2 * np.cos(angles)
            y = 1 - height / 2 + share * height / 2 * np.sin(angles)
            self.polygon(tuple(zip(x.tolist(), y.tolist(), strict=True)), bgr)

    def stripes(self, bgr: tuple[float, ...]) -> None:
        for left in np.arange(-0.2, 1.0, 0.4).tolist():
            self.polygon(((left + 0.2, 0.15), (left + 0.4, 0.15), (left + 0.2, 0.75), (left, 0.75)), bgr)

    def facade(self, *, mirrored: bool) -> Facade:
        parts = (self._overlay, self._opacity, self._shade)
        overlay, opacity, shade = (part[:, ::-1].copy() if mirrored else part for part in parts)
        return Facade(overlay, opacity, shade)


def _car(canvas: _Canvas, face: int) -> None:
    if face in (2, 3):
        canvas.polygon(((0.25, 0.44), (0.35, 0.10), (0.53, 0.08), (0.53, 0.44)), _GLASS)
        canvas.polygon(((0.56, 0.44), (0.56, 0.08), (0.76, 0.10), (0.87, 0.44)), _GLASS)
        canvas.rectangle(0, 0.86, 1, 1, _DARK)
        canvas.wheel(0.2, 0.17, 0.42)
        canvas.wheel(0.8, 0.17, 0.42)
        canvas.rectangle(0, 0.5, 0.04, 0.6, _HEADLAMP)
        canvas.rectangle(0.97, 0.48, 1, 0.6, _TAILLAMP)
    elif face in (0, 1):
        _end(canvas, face, glass=(0.08, 0.44))
    elif face == 4:
        canvas.polygon(((0.08, 0.22), (0.92, 0.22), (0.84, 0.36), (0.16, 0.36)), _GLASS)
        canvas.polygon(((0.14, 0.86), (0.86, 0.86), (0.92, 0.95), (0.08, 0.95)), _GLASS)


def _large(canvas: _Canvas, face: int) -> None:
    if face in (2, 3):
        canvas.rectangle(0.02, 0.16, 0.13, 0.45, _GLASS)
        for left in (0.17, 0.33, 0.49, 0.65, 0.81):
            canvas.rectangle(left, 0.16, left + 0.15, 0.40, _GLASS)
        canvas.rectangle(0, 0.9, 1, 1, _DARK)
        for centre in (0.14, 0.74, 0.84):
            canvas.wheel(centre, 0.09, 0.26)
    elif face in (0, 1):
        _end(canvas, face, glass=(0.12, 0.48))


def _end(canvas: _Canvas, face: int, *, glass: tuple[float, float]) -> None:
    """Front or back of a vehicle: window, lamps, plate, bumper and tyres."""
    top, bottom = glass
    canvas.polygon(((0.16, top), (0.84, top), (0.92, bottom), (0.08, bottom)), _GLASS)
    lamp = _HEADLAMP if face == 0 else _TAILLAMP
    canvas.rectangle(0.05, 0.52, 0.24, 0.62, lamp)
    canvas.rectangle(0.76, 0.52, 0.95, 0.62, lamp)
    canvas.rectangle(0, 0.8, 1, 1, _DARK)
    canvas.rectangle(0.36, 0.68, 0.64, 0.78, _PLATE)
    canvas.rectangle(0.04, 0.84, 0.18, 1, _TYRE)
    canvas.rectangle(0.82, 0.84, 0.96, 1, _TYRE)


def _two_wheeler(canvas: _Canvas, face: int) -> None:
    if face in (2, 3):
        canvas.rectangle(0, 0, 1, 1, _BACKING)
        canvas.wheel(0.22, 0.4, 0.55)
        canvas.wheel(0.78, 0.4, 0.55)
        canvas.polygon(((0.2, 0.36), (0.8, 0.42), (0.72, 0.66), (0.36, 0.7)), None)
        canvas.polygon(((0.5, 0.1), (0.72, 0.1), (0.76, 0.46), (0.52, 0.46)), _TROUSERS)
        canvas.rectangle(0.52, 0, 0.7, 0.1, _SKIN)
    elif face in (0, 1):
        canvas.rectangle(0, 0, 1, 1, _BACKING)
        canvas.polygon(((0.2, 0.1), (0.8, 0.1), (0.7, 0.7), (0.3, 0.7)), None)
        canvas.rectangle(0.35, 0, 0.65, 0.1, _SKIN)
        canvas.rectangle(0.4, 0.5, 0.6, 1, _TYRE)
        canvas.rectangle(0.4, 0.3, 0.6, 0.42, _HEADLAMP if face == 0 else _TAILLAMP)


def _person(canvas: _Canvas, face: int) -> None:
    if face < 4:
        canvas.rectangle(0, 0.52, 1, 1, _TROUSERS)
        canvas.rectangle(0, 0, 1, 0.15, _SKIN if face != 1 else _DARK)
        canvas.rectangle(0, 0, 1, 0.05, _DARK)
        canvas.rectangle(0, 0.95, 1, 1, _TYRE)
    elif face == 4:
        canvas.rectangle(0, 0, 1, 1, _DARK)


def _cone(canvas: _Canvas, face: int) -> None:
    if face < 4:
        canvas.rectangle(0, 0.2, 1, 0.42, _WHITE)
        canvas.rectangle(0, 0.9, 1, 1, _DARK)


def _building(face: int) -> Facade:
    """One window on a storey, repeated over the walls; a plain roof."""
    canvas = _Canvas(1)
    if face < 4:
        canvas.rectangle(0.24, 0.2, 0.76, 0.78, _WHITE)
        canvas.rectangle(0.28, 0.24, 0.48, 0.74, (120.0, 100.0, 82.0))
        canvas.rectangle(0.52, 0.24, 0.72, 0.74, (104.0, 86.0, 70.0))
    plain = canvas.facade(mirrored=False)
    wall = np.ones_like(plain.shade)
    wall[-_HEIGHT_PX // 24 :] = 0.9
    return Facade(plain.overlay_bgr, plain.opacity, wall, repeat_m=(3.2, 3.4))


def _leaves() -> Facade:
    grain = (grain_tile(_GRAIN_SEED, _LEAF_SCALES_PX).astype(np.float32) - 128) / 128
    shade = np.clip(0.95 + 1.2 * grain, 0.4, 1.7).astype(np.float32)
    return Facade(np.zeros((*shade.shape, 3), np.float32), np.zeros_like(shade), shade, repeat_m=(4.0, 4.0))
