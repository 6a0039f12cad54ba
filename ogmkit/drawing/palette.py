"""The colours of every picture: one theme for screens, one for paper.

`tests/drawing/test_palette.py` holds both to WCAG 2.2's contrast, also as the colour-blind see them.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Colour = tuple[int, int, int]
"""Red, green, blue; 0 to 255, sRGB."""
ThemeName = Literal["dark", "light"]


@dataclass(frozen=True)
class Theme:
    """Colours by what they mean.

    Ground, drivable area and marks on either are three steps of lightness, the same in image and plane. A
    fourth has no room between black and white (27 : 1 exceeds 21 : 1), so what is out of view is striped.

    Attributes:
        page: behind everything.
        empty: a panel that has nothing to show.
        line: rules and grids, which carry no meaning.
        text: letters, the ego, and the edge of the view.
        muted: lesser letters.
        alarm: letters that say what is wrong.
        ground: cells that are not drivable.
        drivable: drivable cells, and drivable pixels of an image.
        carpark: cells of a layer of the map, as light as `drivable`; so are the three below.
        walkway: the same.
        road: the same, of road segments.
        lane: the same.
        vehicle: vehicles; where two opinions are compared, what both have.
        first: the truth alone; the past; the median.
        second: the other opinion alone; the plan; the 90th percentile.
        future: the true future and the destination.
    """

    page: Colour
    empty: Colour
    line: Colour
    text: Colour
    muted: Colour
    alarm: Colour
    ground: Colour
    drivable: Colour
    carpark: Colour
    walkway: Colour
    road: Colour
    lane: Colour
    vehicle: Colour
    first: Colour
    second: Colour
    future: Colour


THEMES: Mapping[ThemeName, Theme] = MappingProxyType(
    {
        "dark": Theme(
            page=(13, 17, 23),
            empty=(28, 33, 42),
            line=(62, 72, 86),
            text=(236, 240, 245),
            muted=(160, 171, 185),
            alarm=(255, 210, 43),
            ground=(18, 22, 34),
            drivable=(60, 117, 88),
            carpark=(126, 44, 246),
            walkway=(114, 108, 12),
            road=(54, 114, 144),
            lane=(84, 92, 198),
            vehicle=(255, 210, 43),
            first=(147, 209, 251),
            second=(251, 199, 207),
            future=(244, 255, 190),
        ),
        "light": Theme(
            page=(255, 255, 255),
            empty=(236, 239, 242),
            line=(196, 203, 211),
            text=(24, 28, 34),
            muted=(84, 93, 104),
            alarm=(150, 60, 0),
            ground=(253, 253, 252),
            drivable=(105, 154, 111),
            carpark=(170, 106, 252),
            walkway=(144, 150, 12),
            road=(138, 144, 162),
            lane=(156, 132, 210),
            vehicle=(110, 30, 9),
            first=(0, 40, 136),
            second=(0, 4, 8),
            future=(98, 5, 87),
        ),
    }
)
"""The default first."""

_CURRENT: ContextVar[Theme] = ContextVar("theme", default=THEMES["dark"])


def theme() -> Theme:
    """The theme that is drawn in."""
    return _CURRENT.get()


@contextmanager
def themed(name: ThemeName) -> Iterator[None]:
    """Draw in a theme inside."""
    token = _CURRENT.set(THEMES[name])
    try:
        yield
    finally:
        _CURRENT.reset(token)
