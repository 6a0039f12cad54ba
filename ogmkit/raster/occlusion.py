"""Cells that are seen: past boxes that stand in the way, and by where LiDAR beams got to."""

import numpy as np

from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.grid import GridSpec
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import BoolArray, FloatArray, IntArray, UInt8Array

SECTORS = 1800
"""Of a full turn: LiDAR points of a sector say together how far it is seen."""
_CHUNK = 1 << 16
_SLACK_RAD = 1e-9


def unhidden_mask(
    grid: GridSpec,
    eye_level: FloatArray,
    level_from_global: FloatArray,
    boxes: Boxes,
    seen: UInt8Array | None = None,
) -> UInt8Array:
    """Mark the cells whose centre, on the plane z = 0, is in sight past all boxes.

    A cell is hidden if the segment from the eye to its centre meets a box under which it doesn't lie itself:
    cells under a vehicle are seen unless another one hides them. The ground hides nothing, being flat.

    Args:
        grid: the grid.
        eye_level: (3,) the camera's or LiDAR's centre in the level frame, metres.
        level_from_global: (4, 4).
        boxes: what may stand in the way, of any category.
        seen: (rows, columns) uint8; only cells that it marks are looked at, such as the field of view.

    Returns:
        (rows, columns) uint8, 1 where the cell is seen.
    """
    mask = np.ones(grid.shape, np.uint8) if seen is None else (seen > 0).astype(np.uint8)
    level_from_box = level_from_global @ boxes.global_from_box
    corners = grid.cells(ground_corners(level_from_box, boxes.size_wlh))
    rows, columns = np.nonzero(mask)
    targets = _centres(grid, rows, columns)
    sectors = _Sectors(targets, eye_level)
    hidden = np.zeros(len(rows), dtype=np.bool_)
    for pose, size, quad in zip(level_from_box, boxes.size_wlh, corners, strict=True):
        asked = sectors.of(pose[:, 3], size)
        asked = asked[~hidden[asked]]
        own = fill_polygons([quad], grid.shape)[rows[asked], columns[asked]] > 0
        asked, box_from_level = asked[~own], inverse(pose)
        for start in range(0, len(asked), _CHUNK):
            part = asked[start : start + _CHUNK]
            hidden[part] = _meets(box_from_level, size, eye_level, targets[part])
    mask[rows[hidden], columns[hidden]] = 0
    return mask


def reached_mask(grid: GridSpec, eye_level: FloatArray, points_level: FloatArray) -> UInt8Array:
    """Mark the cells that a LiDAR beam passes or hits: no farther than the farthest point of their sector.

    Beams count by their direction on the plane, ground points too; a sector without points sees nothing.

    Args:
        grid: the grid.
        eye_level: (3,) the LiDAR's centre in the level frame, metres.
        points_level: (P, 3 or more) points of the sweep in the level frame.

    Returns:
        (rows, columns) uint8, 1 where the cell is seen.
    """
    reach_m = np.zeros(SECTORS)
    from_eye = points_level[:, :2].astype(np.float64) - eye_level[:2]
    np.maximum.at(reach_m, _sector(from_eye), np.hypot(*from_eye.T))
    rows, columns = np.indices(grid.shape).reshape(2, -1)
    cells = _centres(grid, rows, columns)[:, :2] - eye_level[:2]
    seen: BoolArray = np.hypot(*cells.T) <= reach_m[_sector(cells)]
    return seen.reshape(grid.shape).astype(np.uint8)


def _centres(grid: GridSpec, rows: IntArray, columns: IntArray) -> FloatArray:
    """(C, 3) centres of cells on the plane z = 0, level frame."""
    positions = grid.positions_m(np.column_stack([columns, rows]))
    return np.column_stack([positions, np.zeros(len(rows))])


class _Sectors:
    """Cells sorted by their direction from the eye, so that those of a box's sector are found at once.

    Args:
        targets: (C, 2 or more) their centres, metres.
        eye: (3,) metres.
    """

    def __init__(self, targets: FloatArray, eye: FloatArray) -> None:
        angles = np.arctan2(targets[:, 1] - eye[1], targets[:, 0] - eye[0])
        self._eye = eye
        self._order = np.argsort(angles)
        self._angles = angles[self._order]

    def of(self, centre: FloatArray, size_wlh: FloatArray) -> IntArray:
        """Cells that lie in the sector of a ball round a box; all of them where the eye is over it."""
        from_eye, radius = centre[:2] - self._eye[:2], np.linalg.norm(size_wlh) / 2
        distance = np.hypot(*from_eye)
        if distance <= radius:
            return self._order
        half, middle = np.arcsin(radius / distance) + _SLACK_RAD, np.arctan2(from_eye[1], from_eye[0])
        ends = [(middle - half + turn, middle + half + turn) for turn in (-2 * np.pi, 0.0, 2 * np.pi)]
        parts = (np.searchsorted(self._angles, both) for both in ends)
        return np.concatenate([self._order[start:stop] for start, stop in parts])


def _meets(
    box_from_level: FloatArray, size_wlh: FloatArray, eye: FloatArray, targets: FloatArray
) -> BoolArray:
    """(C,) whether segments from the eye meet the inside of a box: slabs (Kay & Kajiya, 1986)."""
    start = transform_points(box_from_level, eye[None])[0]
    step = transform_points(box_from_level, targets) - start
    half = size_wlh[[1, 0, 2]] / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (-half - start) / step, (half - start) / step
    level = step == 0  # along a slab: all of the line is in it, or nothing
    within = np.abs(start) < half
    enter = np.where(level, np.where(within, -np.inf, np.inf), np.minimum(one, other)).max(axis=1)
    leave = np.where(level, np.where(within, np.inf, -np.inf), np.maximum(one, other)).min(axis=1)
    result: BoolArray = np.maximum(enter, 0.0) < np.minimum(leave, 1.0)
    return result


def _sector(directions: FloatArray) -> IntArray:
    """(N,) number of the sector that (N, 2) directions on the plane lie in."""
    turn = np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)
    result: IntArray = np.floor((turn % 1.0) * SECTORS).astype(np.int64) % SECTORS
    return result
