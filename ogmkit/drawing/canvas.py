"""A picture to draw on: colours, text, lines, dots and polygons with soft edges."""

import functools
from typing import Literal, cast

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ogmkit.drawing.palette import Colour, theme
from ogmkit.typing import FloatArray, UInt8Array

_SUBPIXEL_BITS = 4
_LONGEST_TEXT = 300
_FARTHEST_PX = 1e6  # keeps OpenCV's fixed-point coordinates within 32 bits


class Canvas:
    """A picture under construction; coordinates are (x right, y down) in pixels, integer = pixel centre.

    Attributes:
        pixels: (height, width, 3) uint8 RGB, changed in place.
    """

    def __init__(self, height: int, width: int, colour: Colour | None = None) -> None:
        self.pixels: UInt8Array = np.empty((height, width, 3), dtype=np.uint8)
        self.pixels[:] = theme().page if colour is None else colour

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width)."""
        return self.pixels.shape[0], self.pixels.shape[1]

    def paste(self, pixels: UInt8Array, left: int, top: int) -> None:
        """Put a (h, w, 3) picture with its top left pixel at (left, top); it must fit."""
        height, width = pixels.shape[:2]
        self.pixels[top : top + height, left : left + width] = pixels

    def fill(self, left: int, top: int, width: int, height: int, colour: Colour) -> None:
        """Fill a rectangle of whole pixels."""
        self.pixels[top : top + height, left : left + width] = colour

    def frame(self, height: int, width: int, colour: Colour) -> None:
        """Draw the border of a rectangle of whole pixels at the top left."""
        for top in (0, height - 1):
            self.fill(0, top, width, 1, colour)
        for left in (0, width - 1):
            self.fill(left, 0, 1, height, colour)

    def polyline(self, points: FloatArray, colour: Colour, thickness: int = 2) -> None:
        """Join (K, 2) points by lines."""
        cv2.polylines(self.pixels, [_fixed(points)], False, colour, thickness, cv2.LINE_AA, _SUBPIXEL_BITS)

    def cased_polyline(self, points: FloatArray, colour: Colour, thickness: int = 2) -> None:
        """Join (K, 2) points by lines with a rim of the page's colour, to be seen on any photo."""
        self.polyline(points, theme().page, thickness + 2)
        self.polyline(points, colour, thickness)

    def dots(self, points: FloatArray, colour: Colour, radius: float, rim: Colour | None = None) -> None:
        """Draw discs with a thin rim, of the page's colour unless told, round (K, 2) points."""
        rim = theme().page if rim is None else rim
        for extra, shade in ((1.5, rim), (0.0, colour)):
            self._circles(points, shade, radius + extra, cv2.FILLED)

    def rings(self, points: FloatArray, colour: Colour, radius: float, inside: UInt8Array) -> None:
        """Draw circles with rims of the page's colour round (K, 2) points.

        Args:
            points: their centres.
            colour: of the circles.
            radius: in pixels.
            inside: (height, width, 3) what is seen through them.
        """
        holes = Canvas(*self.shape, (0, 0, 0))
        holes._circles(points, (1, 1, 1), radius, cv2.FILLED)
        self.pixels[:] = np.where(holes.pixels > 0, inside, self.pixels)
        for shade, extra in ((theme().page, 2), (colour, 0)):
            self._circles(points, shade, radius + extra, 2)

    def _circles(self, points: FloatArray, colour: Colour, radius: float, thickness: int) -> None:
        size = round(radius * (1 << _SUBPIXEL_BITS))
        for x, y in _fixed(points).tolist():
            cv2.circle(self.pixels, (x, y), size, colour, thickness, cv2.LINE_AA, _SUBPIXEL_BITS)

    def polygon(self, points: FloatArray, colour: Colour, opacity: float = 1.0) -> None:
        """Fill a simple polygon of (K, 2) points; with K under 3 there is nothing to fill."""
        if len(points) < 3:
            return
        drawn = self.pixels.copy() if opacity < 1 else self.pixels
        cv2.fillPoly(drawn, [_fixed(points)], colour, cv2.LINE_AA, _SUBPIXEL_BITS)
        if opacity < 1:
            cv2.addWeighted(drawn, opacity, self.pixels, 1 - opacity, 0, dst=self.pixels)

    def tint(self, share: FloatArray, colour: Colour, opacity: float) -> None:
        """Lay a colour over the whole picture, as dense as (height, width) shares between 0 and 1 say."""
        cover = (opacity * share)[..., None]
        self.pixels[:] = np.rint(self.pixels * (1 - cover) + cover * colour)

    def overlay(self, mask: UInt8Array, colour: Colour, opacity: float) -> None:
        """Tint the picture by a mask of any size, 0 or 1, and draw its outline."""
        cover = resize(mask * np.uint8(255), self.shape)
        self.tint(cover / 255, colour, opacity)
        outlines, _ = cv2.findContours(cover // 128, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(self.pixels, outlines, -1, colour, 1)

    def text(
        self,
        text: str,
        x: int,
        baseline: int,
        size: int,
        colour: Colour | None = None,
        align: Literal["left", "centre", "right"] = "left",
    ) -> int:
        """Write a line of text on a baseline.

        Args:
            text: what to write.
            x: the text's left end, middle or right end.
            baseline: y of the line that the letters stand on.
            size: font size in pixels.
            colour: of the letters; None for the theme's.
            align: what `x` means.

        Returns:
            The text's width in pixels.
        """
        text, colour = _plain(text), theme().text if colour is None else colour
        width = text_width(text, size)
        left = x - {"left": 0, "centre": width // 2, "right": width}[align]
        ink, offset_x, offset_y = _ink(text, size)
        top, left = baseline + offset_y, left + offset_x
        rows = _overlap(top, ink.shape[0], self.shape[0])
        columns = _overlap(left, ink.shape[1], self.shape[1])
        cover = ink[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        share = cover[..., None] / np.float32(255)
        self.pixels[rows, columns] = np.rint(self.pixels[rows, columns] * (1 - share) + share * colour)
        return width


def framed(pixels: UInt8Array) -> UInt8Array:
    """A picture with a thin border, where its colours are nearly the page's."""
    canvas = Canvas(*pixels.shape[:2])
    canvas.paste(pixels, 0, 0)
    canvas.frame(*canvas.shape, theme().line)
    return canvas.pixels


def fit(size: tuple[int, int], into: tuple[int, int]) -> tuple[int, int]:
    """The largest (height, width) of the same shape as `size` that fits into another."""
    scale = min(into[0] / size[0], into[1] / size[1])
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def resize(pixels: UInt8Array, size: tuple[int, int], *, photo: bool = False) -> UInt8Array:
    """Scale to (height, width): by area when it shrinks; when it grows, masks stay crisp."""
    grown = cv2.INTER_LINEAR if photo else cv2.INTER_NEAREST_EXACT
    method = cv2.INTER_AREA if size[0] < pixels.shape[0] else grown
    return np.asarray(cv2.resize(pixels, size[::-1], interpolation=method), dtype=np.uint8)


def text_width(text: str, size: int) -> int:
    """Width in pixels of a line of text."""
    return round(_font(size).getlength(_plain(text)))


def shortened(text: str, size: int, width: int) -> str:
    """As much of a line of text as fits into `width` pixels; dots stand for the rest."""
    text = _plain(text)
    if text_width(text, size) <= width:
        return text
    fitting = (text[:length].rstrip() + "…" for length in range(len(text) - 1, 0, -1))
    return next((part for part in fitting if text_width(part, size) <= width), "")


def _plain(text: str) -> str:
    """Text on one line and not endless: names and reasons come from files, which may hold anything."""
    return "".join(c if c.isprintable() else " " for c in text[:_LONGEST_TEXT])


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    return cast(ImageFont.FreeTypeFont, ImageFont.load_default(size))  # scalable whenever a size is given


@functools.lru_cache(maxsize=512)
def _ink(text: str, size: int) -> tuple[UInt8Array, int, int]:
    """Coverage (h, w) uint8 of a text and its place relative to the baseline's left end."""
    left, top, right, bottom = (round(side) for side in _font(size).getbbox(text, anchor="ls"))
    picture = Image.new("L", (max(right - left, 1), max(bottom - top, 1)))
    ImageDraw.Draw(picture).text((-left, -top), text, fill=255, font=_font(size), anchor="ls")
    return np.asarray(picture), left, top


def _fixed(points: FloatArray) -> NDArray[np.int32]:
    """(K, 2) points as OpenCV's fixed-point coordinates."""
    clipped = np.clip(points, -_FARTHEST_PX, _FARTHEST_PX)
    return np.rint(clipped * (1 << _SUBPIXEL_BITS)).astype(np.int32)


def _overlap(start: int, length: int, limit: int) -> slice:
    """The part of start … start + length that lies in 0 … limit, perhaps nothing."""
    return slice(min(max(start, 0), limit), min(max(start + length, 0), limit))
