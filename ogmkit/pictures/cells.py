"""Colours of cells: what the map and the boxes say, and how far a second opinion agrees."""

import numpy as np

from ogmkit.pictures.canvas import ORANGE, PAGE, PURPLE, SKY_BLUE, Colour
from ogmkit.typing import FloatArray, UInt8Array

GROUND_COLOUR: Colour = (34, 41, 51)
DRIVABLE_COLOUR: Colour = (92, 105, 124)
VEHICLE_COLOUR: Colour = ORANGE
ONLY_TRUE_COLOUR: Colour = SKY_BLUE
ONLY_OTHER_COLOUR: Colour = PURPLE
UNSEEN = 0.35
"""How much of its colour a cell outside the field of view keeps."""

_FAINT = 0.45
"""How much of its colour disagreement about the drivable area keeps: vehicles stand out."""


def target_colours(drivable: UInt8Array, vehicles: UInt8Array, field_of_view: UInt8Array) -> UInt8Array:
    """Colours (rows, columns, 3) of (rows, columns) uint8 masks, all but 0 being set: vehicles lie on top."""
    kind = np.where(vehicles > 0, 2, drivable > 0)
    colours: UInt8Array = _TARGETS[(field_of_view > 0).astype(int), kind]
    return colours


def agreement_colours(
    true: tuple[UInt8Array, UInt8Array], other: tuple[UInt8Array, UInt8Array], field_of_view: UInt8Array
) -> UInt8Array:
    """Colours (rows, columns, 3) of the agreement of two opinions where the camera sees.

    Args:
        true: (rows, columns) uint8 masks of drivable area and vehicles, all but 0 being set.
        other: the same by the other opinion.
        field_of_view: (rows, columns) uint8; what is outside is left dark.
    """
    drivable, vehicles = ((one > 0) + 2 * (two > 0) for one, two in zip(true, other, strict=True))
    shown = np.where(vehicles > 0, 3 + vehicles, drivable)
    colours: UInt8Array = _AGREEMENT[np.where(field_of_view > 0, shown, len(_AGREEMENT) - 1)]
    return colours


def overlap(true: UInt8Array, other: UInt8Array, field_of_view: UInt8Array) -> float:
    """Intersection over union of two masks where the camera sees; NaN where neither has anything."""
    seen, one, two = field_of_view > 0, true > 0, other > 0
    union = int(np.count_nonzero((one | two) & seen))
    return int(np.count_nonzero(one & two & seen)) / union if union else float("nan")


def _faded(colour: Colour, into: Colour, share: float) -> FloatArray:
    """The colour by its share, the rest of another."""
    mixed: FloatArray = np.rint(np.array(into) + share * (np.array(colour) - into))
    return mixed


_TARGETS = np.array(
    [
        [_faded(colour, PAGE, share) for colour in (GROUND_COLOUR, DRIVABLE_COLOUR, VEHICLE_COLOUR)]
        for share in (UNSEEN, 1.0)
    ],
    dtype=np.uint8,
)
"""By field of view, then by kind."""
_AGREEMENT = np.array(
    [
        GROUND_COLOUR,
        _faded(ONLY_TRUE_COLOUR, GROUND_COLOUR, _FAINT),
        _faded(ONLY_OTHER_COLOUR, GROUND_COLOUR, _FAINT),
        DRIVABLE_COLOUR,
        ONLY_TRUE_COLOUR,
        ONLY_OTHER_COLOUR,
        VEHICLE_COLOUR,
        _faded(GROUND_COLOUR, PAGE, UNSEEN),
    ],
    dtype=np.uint8,
)
"""By code: true + 2 · other for drivable area, 3 + the same for vehicles; the last one is out of view."""
