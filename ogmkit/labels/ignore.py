"""Cells that pyramid occupancy networks neither train nor score on."""

import numpy as np

from ogmkit.frames import FrameRecord, KeyFrame
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Axis, Definition
from ogmkit.labels.plane import Plane, front_of
from ogmkit.nuscenes.paths import resolve
from ogmkit.raster.lidar import read_points
from ogmkit.typing import BoolArray, FloatArray, UInt8Array

_RAYS = 10000
_MIDDLE_RAY = 5000


def ignored(key_frame: KeyFrame, definition: Definition, plane: Plane) -> UInt8Array:
    """Mark boxes of no class, cells outside the image, and those behind the last LiDAR point of their ray.

    Where the sweep's file is absent, the last is left out (`has_sweep`).

    Returns:
        (rows, columns) uint8.
    """
    frame = front_of(key_frame)
    boxes = key_frame.boxes
    other = np.array([definition.class_of(one) is None for one in boxes.category], dtype=np.bool_)
    corners = box_corners_canvas(definition, plane, boxes.selected(other))
    mask = paint_boxes(definition, corners, [1] * len(corners)) > 0
    right_m, ahead_m = _lattice(definition)
    mask |= _outside(right_m, ahead_m, frame)
    if has_sweep(key_frame):
        mask |= _occluded(right_m, ahead_m, _points_camera(key_frame, frame), definition)
    return mask.astype(np.uint8)


def has_sweep(key_frame: KeyFrame) -> bool:
    """Whether the file of the sample's LiDAR sweep is there."""
    return resolve(key_frame.dataroot, key_frame.lidar_path).is_file()


def _lattice(definition: Definition) -> tuple[FloatArray, FloatArray]:
    """Right and ahead, metres, of the points that indices stand for: (1, columns) and (rows, 1)."""
    grid, at = definition.grid, definition.cell.index_at
    ahead, right = (_indices_m(axis, at) for axis in (grid.rows, grid.columns))
    return right[None, :], ahead[:, None]


def _indices_m(axis: Axis, index_at: float) -> FloatArray:
    steps = np.arange(axis.cells, dtype=np.float64)
    result: FloatArray = axis.first_m + index_at * axis.step_m + axis.step_m * steps
    return result


def _outside(right_m: FloatArray, ahead_m: FloatArray, frame: FrameRecord) -> BoolArray:
    column = right_m / ahead_m * frame.intrinsics[0, 0] + frame.intrinsics[0, 2]
    outside: BoolArray = (column < 0) | (column >= frame.image_size[1])
    return outside


def _points_camera(key_frame: KeyFrame, frame: FrameRecord) -> FloatArray:
    """(P, 3) points of the sweep in the camera's frame at the image's time, ground and all."""
    path = resolve(key_frame.dataroot, key_frame.lidar_path)
    points = read_points(path, "restore or remove it")[:, :3].astype(np.float64)
    points_global = transform_points(key_frame.global_from_ego @ key_frame.ego_from_lidar, points)
    return transform_points(inverse(frame.global_from_ego @ frame.ego_from_camera), points_global)


def _occluded(
    right_m: FloatArray, ahead_m: FloatArray, points: FloatArray, definition: Definition
) -> BoolArray:
    """Cells ahead of the farthest point of their ray; 10,000 rays by the tangent of the angle."""
    rows = definition.grid.rows
    width = rows.step_m / (rows.first_m + definition.cell.index_at * rows.step_m + rows.step_m * rows.cells)
    ahead = points[points[:, 2] > 0]
    ray = np.round(ahead[:, 0] / ahead[:, 2] / width + _MIDDLE_RAY)
    kept = (ray > 0) & (ray < _RAYS)
    farthest = np.zeros(_RAYS + 1)
    np.maximum.at(farthest, ray[kept].astype(np.int64), ahead[kept, 2])
    ray_of_cell = np.round(right_m / ahead_m / width + _MIDDLE_RAY)
    inside = (ray_of_cell >= 0) & (ray_of_cell <= _RAYS)
    reach = np.where(inside, farthest[np.clip(ray_of_cell, 0, _RAYS).astype(np.int64)], 0.0)
    occluded: BoolArray = reach < ahead_m
    return occluded
