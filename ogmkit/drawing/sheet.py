"""A contact sheet: a heading, tiles of panels side by side, and a legend."""

from collections.abc import Sequence
from dataclasses import dataclass

from ogmkit.drawing.canvas import Canvas, shortened
from ogmkit.drawing.legend import TEXT_SIZE, Group, draw_legend
from ogmkit.drawing.palette import theme
from ogmkit.typing import UInt8Array

GAP = 12
"""Pixels between the pictures of a tile."""
CAPTION = 36
"""Height in pixels of a line of titles."""

_MARGIN, _TILE_GAP = 40, 44
_HEADER = 104
_TITLE_SIZE = 40


@dataclass(frozen=True, eq=False)
class Panel:
    """A picture of a tile.

    Attributes:
        pixels: (h, w, 3) uint8 RGB.
        title: stands above it.
        subtitle: stands smaller beside the title.
    """

    pixels: UInt8Array
    title: str = ""
    subtitle: str = ""


Column = Panel | Sequence[Panel]
"""A panel, or some below each other."""


@dataclass(frozen=True)
class Heading:
    """What a sheet is about: scene and camera stand large, the note small below them."""

    scene: str
    camera: str
    note: str


@dataclass(frozen=True)
class Caption:
    """What stands above a tile: title and subtitle at the left end, a note at the right.

    Attributes:
        title: such as the time.
        subtitle: stands paler beside it.
        note: what is to be said of the tile.
        alarm: whether the note says that something is wrong.
    """

    title: str
    subtitle: str = ""
    note: str = ""
    alarm: bool = False


def draw_tile(columns: Sequence[Column], caption: Caption | None = None) -> UInt8Array:
    """Draw columns of panels side by side, each panel below its title: (h, w, 3) uint8."""
    drawn = [_draw_column([one] if isinstance(one, Panel) else one) for one in columns]
    top = 0 if caption is None else CAPTION
    height = max(column.shape[0] for column in drawn)
    tile = Canvas(top + height, sum(column.shape[1] for column in drawn) + GAP * (len(drawn) - 1))
    if caption is not None:
        _draw_caption(tile, caption)
    left = 0
    for column in drawn:
        tile.paste(column, left, top)
        left += column.shape[1] + GAP
    return tile.pixels


def _draw_column(panels: Sequence[Panel]) -> UInt8Array:
    """Panels of one width below each other, a gap between them."""
    heights = [CAPTION + panel.pixels.shape[0] for panel in panels]
    column = Canvas(sum(heights) + GAP * (len(panels) - 1), max(panel.pixels.shape[1] for panel in panels))
    top = 0
    for panel, height in zip(panels, heights, strict=True):
        column.paste(panel.pixels, 0, top + CAPTION)
        _draw_titles(column, panel.title, panel.subtitle, top, column.shape[1])
        top += height + GAP
    return column.pixels


def _draw_titles(canvas: Canvas, title: str, subtitle: str, top: int, width: int) -> int:
    """Write what fits into `width` pixels; returns where the text ends."""
    baseline = top + CAPTION - 11
    taken = canvas.text(shortened(title, TEXT_SIZE, width), 0, baseline, TEXT_SIZE) + GAP
    shown = shortened(subtitle, TEXT_SIZE, width - taken)
    return taken + canvas.text(shown, taken, baseline, TEXT_SIZE, theme().muted)


def _draw_caption(tile: Canvas, caption: Caption) -> None:
    right = tile.shape[1]
    taken = _draw_titles(tile, caption.title, caption.subtitle, 0, right)
    colour = theme().alarm if caption.alarm else theme().muted
    note = shortened(caption.note, TEXT_SIZE, right - taken - 2 * GAP)
    tile.text(note, right, CAPTION - 11, TEXT_SIZE, colour, "right")


def draw_sheet(
    heading: Heading, tiles: Sequence[UInt8Array], columns: int, groups: Sequence[Group]
) -> UInt8Array:
    """Draw tiles in reading order.

    Args:
        heading: stands at the top left.
        tiles: at least one, of about the same size.
        columns: tiles beside each other; one if there are only two.
        groups: the legend's.

    Returns:
        (h, w, 3) uint8 RGB.
    """
    columns = 1 if len(tiles) <= 2 else min(columns, len(tiles))
    rows = -(-len(tiles) // columns)
    tile_height, tile_width = (max(tile.shape[axis] for tile in tiles) for axis in (0, 1))
    legend = draw_legend(groups, columns * (tile_width + _TILE_GAP) - _TILE_GAP)
    top = _MARGIN + _HEADER
    bottom = top + rows * (tile_height + _TILE_GAP)
    canvas = Canvas(bottom + legend.shape[0] + _MARGIN // 2, legend.shape[1] + 2 * _MARGIN)
    _draw_heading(canvas, heading, legend.shape[1])
    for place, tile in enumerate(tiles):
        row, column = divmod(place, columns)
        left = _MARGIN + column * (tile_width + _TILE_GAP)
        canvas.paste(tile, left, top + row * (tile_height + _TILE_GAP))
    canvas.paste(legend, _MARGIN, bottom)
    return canvas.pixels


def _draw_heading(canvas: Canvas, heading: Heading, width: int) -> None:
    taken = canvas.text(heading.scene, _MARGIN, _MARGIN + 32, _TITLE_SIZE)
    canvas.text(heading.camera, _MARGIN + taken + 20, _MARGIN + 32, _TITLE_SIZE, theme().muted)
    note = shortened(heading.note, TEXT_SIZE, width)
    canvas.text(note, _MARGIN, _MARGIN + 72, TEXT_SIZE, theme().muted)
