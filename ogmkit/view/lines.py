"""Boxes and grid as lines in an image, counted from its corner as Rerun does; rotations as it takes them."""

from collections.abc import Iterable

import cv2
import numpy as np

from ogmkit.geometry.boxes import EDGES, box_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.polygons import clip_near_plane, clip_rectangle
from ogmkit.grid import GridSpec
from ogmkit.typing import FloatArray
from ogmkit.view.classes import box_class
from ogmkit.view.frames import CameraFrame

CORNER = 0.5
"""From the centre of the first pixel or cell, where ogmkit counts from, to its corner, where Rerun does."""
_NEAR_M = 0.1
_LINES_M, _APART_M = 10.0, 1.0
"""Lines of a homography's grid, and points on each."""


def projected_boxes(frame: CameraFrame) -> tuple[list[FloatArray], list[int]]:
    """Edges of the boxes as far as the image shows them, in pixels, and the class of each."""
    strips, numbers = [], []
    height, width = frame.image_size
    corners = box_corners(frame.camera_from_box, frame.boxes.size_wlh)
    for box, category in zip(corners, frame.boxes.category, strict=True):
        if box[:, 2].max() <= _NEAR_M:
            continue
        for edge in EDGES:
            visible = clip_near_plane(box[list(edge)], _NEAR_M)
            pixels = project(frame.intrinsics, visible)[0] + CORNER
            shown = clip_rectangle(pixels, (0, 0), (width, height))
            if len(shown) > 1:
                strips.append(shown)
                numbers.append(box_class(category))
    return strips, numbers


def ground_lines(grid: GridSpec, bev_from_image: FloatArray, size: tuple[int, int]) -> list[FloatArray]:
    """Where a homography sees the grid's lines of every 10 m in an image of that (height, width).

    Returns:
        Strips of (K, 2) pixels, from the corner; a point a metre, as far as these lie in the image and
        before the camera, where w is positive.
    """
    image_from_bev = np.linalg.inv(bev_from_image)
    strips = []
    for line in _lines(grid):
        pixels = np.column_stack([grid.cells(line), np.ones(len(line))]) @ image_from_bev.T
        before = pixels[pixels[:, 2] > 0]
        found = before[:, :2] / before[:, 2:] + CORNER
        inside = found[((found >= 0) & (found <= size[::-1])).all(axis=1)]
        if len(inside) > 1:
            strips.append(inside)
    return strips


def _lines(grid: GridSpec) -> Iterable[FloatArray]:
    """(K, 2) points in metres on lines across and along the grid."""
    (near, far), (right, left) = grid.x_range_m, grid.y_range_m
    along, across = (_spaced(*one, _APART_M) for one in ((near, far), (right, left)))
    for x in _spaced(near, far, _LINES_M):
        yield np.column_stack([np.full(len(across), x), across])
    for y in _spaced(right, left, _LINES_M):
        yield np.column_stack([along, np.full(len(along), y)])


def _spaced(first: float, last: float, apart: float) -> FloatArray:
    """Multiples of a distance within a range, and its ends."""
    inner = np.arange(np.floor(first / apart) + 1, np.ceil(last / apart)) * apart
    found: FloatArray = np.concatenate([[first], inner, [last]])
    return found


def quaternion_xyzw(rotation: FloatArray) -> FloatArray:
    """(4,) unit quaternion of a (3, 3) rotation."""
    axis_angle = cv2.Rodrigues(rotation)[0][:, 0]
    angle = float(np.linalg.norm(axis_angle))
    found: FloatArray = np.append(np.sinc(angle / 2 / np.pi) / 2 * axis_angle, np.cos(angle / 2))
    return found
