"""A contact sheet: a heading, tiles of panels side by side, and a legend."""

from collections.abc import Sequence
from dataclasses import dataclass

from ogmkit.pictures.canvas import MUTED, YELLOW, Canvas, Colour, shortened
from ogmkit.pictures.legend import TEXT_SIZE, Group, draw_legend
from ogmkit.typing import UInt8Array

GAP = 12
"""Pixels between the pictures of a tile."""

_MARGIN, _TILE_GAP = 40, 36
_HEADER, _CAPTION = 104, 44
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


@dataclass(frozen=True)
class Heading:
    """What a sheet is about: scene and camera stand large, the note small below them."""

    scene: str
    camera: str
    note: str


def draw_tile(panels: Sequence[Panel], note: str = "", *, alarm: bool = False) -> UInt8Array:
    """Draw panels side by side with their titles above, and a note at the right end: (h, w, 3) uint8."""
    heights, widths = zip(*(panel.pixels.shape[:2] for panel in panels), strict=True)
    tile = Canvas(_CAPTION + max(heights), sum(widths) + GAP * (len(panels) - 1))
    left, baseline, taken = 0, _CAPTION - 12, 0
    for panel in panels:
        tile.paste(panel.pixels, left, _CAPTION)
        if panel.title:
            taken = left + tile.text(panel.title, left, baseline, TEXT_SIZE) + GAP
            taken += tile.text(panel.subtitle, taken, baseline, TEXT_SIZE, MUTED)
        left += panel.pixels.shape[1] + GAP
    colour: Colour = YELLOW if alarm else MUTED
    right = tile.shape[1]
    tile.text(
        shortened(note, TEXT_SIZE, right - taken - 2 * GAP), right, baseline, TEXT_SIZE, colour, "right"
    )
    return tile.pixels


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
    columns = 1 if len(tiles) <= 2 else columns
    rows = -(-len(tiles) // columns)
    tile_height, tile_width = (max(tile.shape[axis] for tile in tiles) for axis in (0, 1))
    legend = draw_legend(groups, columns * (tile_width + _TILE_GAP) - _TILE_GAP)
    top = _MARGIN + _HEADER
    bottom = top + rows * (tile_height + _TILE_GAP)
    canvas = Canvas(bottom + legend.shape[0] + _MARGIN // 2, legend.shape[1] + 2 * _MARGIN)
    taken = canvas.text(heading.scene, _MARGIN, _MARGIN + 32, _TITLE_SIZE)
    canvas.text(heading.camera, _MARGIN + taken + 20, _MARGIN + 32, _TITLE_SIZE, MUTED)
    note = shortened(heading.note, TEXT_SIZE, legend.shape[1])
    canvas.text(note, _MARGIN, _MARGIN + 72, TEXT_SIZE, MUTED)
    for place, tile in enumerate(tiles):
        row, column = divmod(place, columns)
        left = _MARGIN + column * (tile_width + _TILE_GAP)
        canvas.paste(tile, left, top + row * (tile_height + _TILE_GAP))
    canvas.paste(legend, _MARGIN, bottom)
    return canvas.pixels
