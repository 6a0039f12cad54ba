"""Colours of cells: what the map and the boxes say, and how far a second opinion agrees."""

import cv2
import numpy as np
from numpy.typing import NDArray

from ogmkit.drawing.palette import theme
from ogmkit.typing import BoolArray, UInt8Array

_STRIPES, _LEAST_PERIOD = 50, 8
_FINE = 500
_EDGE_SHARE = 300


def target_colours(drivable: UInt8Array, vehicles: UInt8Array, field_of_view: UInt8Array) -> UInt8Array:
    """Colours (rows, columns, 3) of (rows, columns) uint8 masks, all but 0 being set: vehicles lie on top.

    What is out of view is striped with the ground's colour; a line shows where the view ends.
    """
    colours = theme()
    table = np.array([colours.ground, colours.drivable, colours.vehicle], np.uint8)
    shown = table[np.where(vehicles > 0, 2, drivable > 0)]
    seen = field_of_view > 0
    shown[~seen & stripes(seen.shape, 1)] = colours.ground
    return with_edge(shown, seen)


def agreement_colours(
    true: tuple[UInt8Array, UInt8Array], other: tuple[UInt8Array, UInt8Array], field_of_view: UInt8Array
) -> UInt8Array:
    """Colours (rows, columns, 3) of the agreement of two opinions where the camera sees.

    Disagreement on the drivable area is striped, upward to the right where only the truth has it and downward
    where only the other does; vehicles lie on top, solid.

    Args:
        true: (rows, columns) uint8 masks of drivable area and vehicles, all but 0 being set.
        other: the same by the other opinion.
        field_of_view: (rows, columns) uint8; nothing is compared outside.
    """
    colours, seen = theme(), field_of_view > 0
    drivable, vehicles = (
        np.where(seen, (one > 0) + 2 * (two > 0), 0) for one, two in zip(true, other, strict=True)
    )
    solid = np.array([colours.ground, colours.first, colours.second, colours.drivable], np.uint8)
    shown = solid[drivable]
    for code, slope in ((1, 1), (2, -1)):
        shown[(drivable == code) & stripes(seen.shape, slope)] = colours.ground
    on_top = np.array([colours.ground, colours.first, colours.second, colours.vehicle], np.uint8)
    shown = np.where((vehicles > 0)[..., None], on_top[vehicles], shown)
    return with_edge(shown, seen)


def refined(mask: UInt8Array) -> UInt8Array:
    """A mask of few rows with its cells repeated: stripes and edges are thinner than such a cell."""
    times = max(1, _FINE // mask.shape[0])
    return np.repeat(np.repeat(mask, times, axis=0), times, axis=1)


def overlap(true: UInt8Array, other: UInt8Array, field_of_view: UInt8Array) -> float:
    """Intersection over union of two masks where the camera sees; NaN where neither has anything."""
    seen, one, two = field_of_view > 0, true > 0, other > 0
    union = int(np.count_nonzero((one | two) & seen))
    return int(np.count_nonzero(one & two & seen)) / union if union else float("nan")


def stripes(shape: tuple[int, ...], slope: int) -> BoolArray:
    """(rows, columns) every other stripe of about fifty: as wide in a picture whatever the size of cells.

    Args:
        shape: (rows, columns).
        slope: 1 for stripes upward to the right, −1 for the others.
    """
    period = max(_LEAST_PERIOD, shape[0] // _STRIPES)
    row, column = np.ogrid[: shape[0], : shape[1]]
    striped: BoolArray = (row + slope * column) % period < period // 2
    return striped


def with_edge(colours: UInt8Array, area: BoolArray) -> UInt8Array:
    """The cells, changed in place, with a line along the inner side of an area's edge, such as the view's."""
    reach = 1 + 2 * max(1, area.shape[0] // _EDGE_SHARE)
    kernel = np.ones((reach, reach), np.uint8)
    inner: NDArray[np.uint8] = np.asarray(cv2.erode(area.astype(np.uint8), kernel), np.uint8)
    colours[area & (inner == 0)] = theme().text
    return colours
