"""A plot as shapes, for papers: drawn as on a canvas, written as SVG or PDF."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ogmkit.drawing.canvas import text_width
from ogmkit.drawing.palette import Colour, theme
from ogmkit.typing import FloatArray

Align = Literal["left", "centre", "right"]


@dataclass(frozen=True)
class Rectangle:
    """Filled; pixels (x right, y down), its corner at (left, top)."""

    left: float
    top: float
    width: float
    height: float
    colour: Colour


@dataclass(frozen=True)
class Line:
    """Joins points (x, y)."""

    points: tuple[tuple[float, float], ...]
    thickness: float
    colour: Colour


@dataclass(frozen=True)
class Disc:
    """Filled."""

    x: float
    y: float
    radius: float
    colour: Colour


@dataclass(frozen=True)
class Letters:
    """A line of text; `x` is its end, or middle, that `align` says."""

    text: str
    x: float
    baseline: float
    size: float
    align: Align
    colour: Colour


Shape = Rectangle | Line | Disc | Letters


class Drawing:
    """Takes what `ogmkit.drawing.canvas.Canvas` takes of a plot, and keeps it as shapes.

    Attributes:
        height: in pixels, as `width`.
        shapes: in the order in which they lie on one another.
    """

    def __init__(self, height: int, width: int) -> None:
        self.height = height
        self.width = width
        self.shapes: list[Shape] = [Rectangle(0, 0, width, height, theme().page)]

    def fill(self, left: int, top: int, width: int, height: int, colour: Colour) -> None:
        """Fill a rectangle."""
        self.shapes.append(Rectangle(left, top, width, height, colour))

    def polyline(self, points: FloatArray, colour: Colour, thickness: int = 2) -> None:
        """Join (K, 2) points by lines."""
        self.shapes.append(Line(tuple((float(x), float(y)) for x, y in points), thickness, colour))

    def dots(self, points: FloatArray, colour: Colour, radius: float, rim: Colour | None = None) -> None:
        """Draw discs with a rim, of the page's colour unless told, round (K, 2) points."""
        shades: Sequence[tuple[float, Colour]] = ((1.5, theme().page if rim is None else rim), (0, colour))
        for x, y in points.tolist():
            self.shapes += [Disc(x, y, radius + extra, shade) for extra, shade in shades]

    def text(
        self,
        text: str,
        x: int,
        baseline: int,
        size: int,
        colour: Colour | None = None,
        align: Align = "left",
    ) -> int:
        """Write a line of text; returns about how wide it is."""
        self.shapes.append(
            Letters(text, x, baseline, size, align, theme().text if colour is None else colour)
        )
        return text_width(text, size)
