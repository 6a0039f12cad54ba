"""How two labels of the same cells differ: counts by range and by shift, which add up over frames."""

from collections.abc import Mapping

import numpy as np

from ogmkit.labels.definition import Axis, Definition
from ogmkit.labels.make import NO_VISIBILITY, LabelArray
from ogmkit.typing import BoolArray, IntArray

RANGES = {"all": (0.0, np.inf), "0–20 m": (0.0, 20.0), "20–40 m": (20.0, 40.0), "40 m +": (40.0, np.inf)}
"""Distance of a cell's centre from the frame's origin, from and below."""
ANY_BOX = "visibility"
"""A class that stands for all boxes that a definition's `visibility` shows."""
VEHICLES = "vehicle"
"""Of a definition that has no class of that name: the union of its `VEHICLE_CLASSES`."""
VEHICLE_CLASSES = ("car", "truck", "bus", "trailer", "construction_vehicle", "motorcycle", "bicycle")
LARGEST_SHIFT = 2
SHIFTS = tuple(
    (row, column)
    for row in range(-LARGEST_SHIFT, LARGEST_SHIFT + 1)
    for column in range(-LARGEST_SHIFT, LARGEST_SHIFT + 1)
)
"""Rows and columns that one array may lie before the other."""


def same_cells(one: Definition, other: Definition) -> bool:
    """Whether two definitions' nominal cells lie on the same plane, but for the part of a pose's rotation."""
    planes = [_origin(definition) for definition in (one, other)]
    return (
        planes[0] == planes[1]
        and _upright(one.grid.rows) == _upright(other.grid.rows)
        and _upright(one.grid.columns) == _upright(other.grid.columns)
    )


def masks_of(arrays: Mapping[str, LabelArray], definition: Definition) -> dict[str, BoolArray]:
    """Class → (rows, columns) where it is, rows and columns turned so that coordinates grow along them."""
    turn = tuple(
        slice(None, None, -1 if axis.step_m < 0 else 1)
        for axis in (definition.grid.rows, definition.grid.columns)
    )
    masks = {name: arrays[name][turn] > 0 for name in definition.class_names}
    united = [masks[name] for name in VEHICLE_CLASSES if name in masks]
    if VEHICLES not in masks and united:
        masks[VEHICLES] = np.logical_or.reduce(united)
    if ANY_BOX in definition.beside and "instance" not in definition.beside:
        masks[ANY_BOX] = arrays[ANY_BOX][turn] != NO_VISIBILITY
    return masks


def range_masks(definition: Definition) -> dict[str, BoolArray]:
    """Range → (rows, columns) where it is, turned likewise."""
    row, column = (np.sort(axis.centres_m) for axis in (definition.grid.rows, definition.grid.columns))
    distance = np.hypot(row[:, None], column[None, :])
    return {name: (distance >= low) & (distance < high) for name, (low, high) in RANGES.items()}


def counts_by_range(one: BoolArray, other: BoolArray, ranges: Mapping[str, BoolArray]) -> IntArray:
    """(ranges, 3) int64: cells of one, of the other, of both."""
    both = one & other
    return np.array(
        [[np.count_nonzero(mask & where) for mask in (one, other, both)] for where in ranges.values()],
        dtype=np.int64,
    )


def counts_by_shift(one: BoolArray, other: BoolArray) -> IntArray:
    """(shifts, 2) int64 for each of `SHIFTS`: cells of both, and of either, where both arrays have cells.

    A shift (r, c) puts `one[row + r, column + c]` on `other[row, column]`.
    """
    counts = np.zeros((len(SHIFTS), 2), dtype=np.int64)
    for number, (row, column) in enumerate(SHIFTS):
        moved = one[_from(row), _from(column)]
        kept = other[_from(-row), _from(-column)]
        both = np.count_nonzero(moved & kept)
        counts[number] = both, np.count_nonzero(moved) + np.count_nonzero(kept) - both
    return counts


def _from(shift: int) -> slice:
    return slice(shift, None) if shift >= 0 else slice(None, shift)


def _origin(definition: Definition) -> str:
    """What the plane's origin hangs on: of the ego frames, the part of a pose's rotation is left aside."""
    return "lidar-ego" if definition.frame.startswith(("lidar-ego", "lidar-level")) else definition.frame


def _upright(axis: Axis) -> tuple[str, float, float, int]:
    return axis.coordinate, round(float(axis.centres_m.min()), 6), abs(axis.step_m), axis.cells
