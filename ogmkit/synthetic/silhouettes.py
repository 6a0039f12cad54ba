"""Convex boxes in the image: outlines with exact coverage, and inverse depths that are affine in the pixel.

A plane n·X = d of the camera frame has 1/depth = (n / d)·K⁻¹(u, v, 1). A ray enters a convex box through the
farthest of the planes that face the camera, so the box's inverse depth is the smallest of theirs.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ogmkit.geometry.boxes import EDGES
from ogmkit.geometry.camera import project
from ogmkit.typing import BoolArray, Float32Array, FloatArray

NEAR_M = 0.1

FACE_NORMALS = np.array(
    [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
)
"""Outward normals in the box's frame, as faces are numbered: front, back, left, right, top, bottom."""


@dataclass(frozen=True)
class Window:
    """A rectangle of pixels: rows `top` to `bottom` and columns `left` to `right`, ends excluded."""

    top: int
    bottom: int
    left: int
    right: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of this window in an image."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def affine(self, coefficients: FloatArray) -> Float32Array:
        """Values (h, w) of a·u + b·v + c at the window's pixels, for coefficients (3,)."""
        along_u = coefficients[0] * np.arange(self.left, self.right) + coefficients[2]
        along_v = coefficients[1] * np.arange(self.top, self.bottom)
        values: Float32Array = np.add.outer(along_v.astype(np.float32), along_u.astype(np.float32))
        return values


@dataclass(frozen=True, eq=False)
class Silhouette:
    """Where a convex body appears in an image.

    Attributes:
        edges: (E, 3) coefficients a, b, c per edge: a·u + b·v + c is the distance to the inside in pixels.
        window: the pixels that it may cover, cut to the image.
    """

    edges: FloatArray
    window: Window


def silhouette(
    corners_camera: FloatArray, intrinsics: FloatArray, image_size: tuple[int, int], margin_px: float = 0.5
) -> Silhouette | None:
    """Project a box, as far as it lies beyond the near plane.

    Args:
        corners_camera: (8, 3) corners in the order of `geometry.boxes`.
        intrinsics: (3, 3).
        image_size: height, width in pixels.
        margin_px: how far the window reaches beyond the outline.

    Returns:
        The silhouette; None where the box is behind the camera, outside the image or without area.
    """
    points = _beyond_near_plane(corners_camera)
    if len(points) < 3:
        return None
    pixels, _ = project(intrinsics, points)
    window = _bounds(pixels, image_size, margin_px)
    edges = _hull_edges(pixels) if window is not None else None
    return Silhouette(edges, window) if edges is not None and window is not None else None


def _beyond_near_plane(corners_camera: FloatArray) -> FloatArray:
    """Points (N, 3) whose convex hull is the part of a box beyond the near plane."""
    depth = corners_camera[:, 2] - NEAR_M
    if depth.min() >= 0:
        return corners_camera
    first, second = np.array(EDGES).T
    crossing = (depth[first] >= 0) != (depth[second] >= 0)
    first, second = first[crossing], second[crossing]
    share = (depth[first] / (depth[first] - depth[second]))[:, None]
    cuts = corners_camera[first] + share * (corners_camera[second] - corners_camera[first])
    return np.concatenate([corners_camera[depth >= 0], cuts])


def _bounds(pixels: FloatArray, image_size: tuple[int, int], margin_px: float) -> Window | None:
    """The window that holds all pixels (N, 2) and a margin, cut to the image; None outside it."""
    height_px, width_px = image_size
    (u_min, v_min), (u_max, v_max) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
    left, top = max(math.floor(u_min - margin_px), 0), max(math.floor(v_min - margin_px), 0)
    right = min(math.ceil(u_max + margin_px) + 1, width_px)
    bottom = min(math.ceil(v_max + margin_px) + 1, height_px)
    return Window(top, bottom, left, right) if right > left and bottom > top else None


def _hull_edges(pixels: FloatArray) -> FloatArray | None:
    """Edges (E, 3) of the convex hull of pixels (N, 2), as in `Silhouette`; None where it has no area."""
    hull = pixels[cv2.convexHull(pixels.astype(np.float32), returnPoints=False)[:, 0]]
    edges = np.concatenate([hull[1:], hull[:1]]) - hull
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    proper = lengths > 1e-6
    hull, inner = (
        hull[proper],
        np.stack([-edges[proper, 1], edges[proper, 0]], axis=-1) / lengths[proper, None],
    )
    if len(hull) < 3 or np.ptp(hull @ inner[0]) < 1e-3:
        return None
    # The hull may run either way round: turn the normals so that the hull's middle is inside.
    if (hull.mean(axis=0) - hull[0]) @ inner[0] < 0:
        inner = -inner
    return np.column_stack([inner, -(inner * hull).sum(axis=1)])


def coverage(shape: Silhouette) -> Float32Array:
    """Share (h, w) of the window's pixels inside: over 0.5 exactly where a pixel's centre is inside."""
    nearest = shape.window.affine(shape.edges[0])
    for edge in shape.edges[1:]:
        np.minimum(nearest, shape.window.affine(edge), out=nearest)
    nearest += np.float32(0.5)
    share: Float32Array = np.clip(nearest, 0, 1, out=nearest)
    return share


def face_planes(
    camera_from_box: FloatArray, size_wlh: FloatArray, intrinsics: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Inverse depth of every face's plane, and which faces look at the camera.

    Args:
        camera_from_box: (M, 4, 4).
        size_wlh: (M, 3).
        intrinsics: (3, 3).

    Returns:
        (M, 6, 3) coefficients of 1/depth as a·u + b·v + c in 1/m, and (M, 6) whether the camera is outside.
    """
    normals = np.einsum("mij,fj->mfi", camera_from_box[:, :3, :3], FACE_NORMALS)
    half = size_wlh[:, [1, 1, 0, 0, 2, 2]] / 2
    offsets = np.einsum("mfi,mi->mf", normals, camera_from_box[:, :3, 3]) + half
    facing = offsets < -1e-9
    rays = normals @ np.linalg.inv(intrinsics)
    return rays / np.where(facing, offsets, -1.0)[..., None], facing
