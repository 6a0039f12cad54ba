"""How much of each solid the cameras see: what visibility levels are counted from."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.synthetic.parts import Parts, split_into_parts
from ogmkit.synthetic.scenery import Solids
from ogmkit.synthetic.silhouettes import NEAR_M, Silhouette, face_planes, silhouette
from ogmkit.typing import BoolArray, FloatArray

CameraView = tuple[FloatArray, FloatArray, tuple[int, int]]
"""Intrinsics (3, 3), `global_from_camera` (4, 4), and the image's height and width in pixels."""

_SAMPLES = 16


def visible_fraction(solids: Solids, views: Sequence[CameraView]) -> FloatArray:
    """Share of each solid's silhouette that no other solid covers, over all views together.

    What lies outside the images doesn't count. Each silhouette is sampled on a grid of its own, so that small
    and far solids are judged as finely as large ones. The ground covers nothing.

    Args:
        solids: the boxes, M of them.
        views: the cameras.

    Returns:
        (M,) from 0 (hidden, or in no view) to 1.
    """
    parts = split_into_parts(solids)
    shown_px, total_px = np.zeros(len(solids)), np.zeros(len(solids))
    for view in views:
        seen = _parts_in_view(parts, view)
        for part in seen:
            samples, area_px = part.samples()
            covered = np.zeros(len(samples), dtype=np.bool_)
            for other in seen:
                if other.solid != part.solid and other.may_cover(part):
                    covered |= other.covers(samples, part.inverse_depth(samples))
            total_px[part.solid] += area_px * len(samples)
            shown_px[part.solid] += area_px * (~covered).sum()
    return np.divide(shown_px, total_px, out=np.zeros(len(solids)), where=total_px > 0)


@dataclass(frozen=True, eq=False)
class _PartInView:
    """A part in an image: its outline, the planes (F, 3) of its facing sides, and its range of depths."""

    solid: int
    shape: Silhouette
    planes: FloatArray
    nearest_m: float
    farthest_m: float

    def samples(self) -> tuple[FloatArray, float]:
        """Homogeneous pixels (S, 3) inside the silhouette, and how many square pixels each stands for."""
        steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        # The window's first pixel reaches half a pixel beyond its centre.
        window = self.shape.window
        width, height = window.right - window.left, window.bottom - window.top
        u, v = np.meshgrid(window.left - 0.5 + width * steps, window.top - 0.5 + height * steps)
        pixels = np.stack([u.ravel(), v.ravel(), np.ones(u.size)], axis=-1)
        return pixels[self._contains(pixels)], width * height / _SAMPLES**2

    def inverse_depth(self, pixels: FloatArray) -> FloatArray:
        """1/depth (S,) of the surface at homogeneous pixels (S, 3)."""
        return np.asarray((pixels @ self.planes.T).min(axis=1), dtype=np.float64)

    def may_cover(self, other: "_PartInView") -> bool:
        """Whether the windows overlap and this part is not wholly behind."""
        mine, theirs = self.shape.window, other.shape.window
        apart = (
            mine.left >= theirs.right
            or theirs.left >= mine.right
            or mine.top >= theirs.bottom
            or theirs.top >= mine.bottom
        )
        return not apart and self.nearest_m < other.farthest_m

    def covers(self, pixels: FloatArray, inverse_depth: FloatArray) -> BoolArray:
        """Whether this part is in front of surfaces (S,) at homogeneous pixels (S, 3)."""
        return self._contains(pixels) & (self.inverse_depth(pixels) > inverse_depth)

    def _contains(self, pixels: FloatArray) -> BoolArray:
        return np.asarray((pixels @ self.shape.edges.T >= 0).all(axis=1), dtype=np.bool_)


def _parts_in_view(parts: Parts, view: CameraView) -> list[_PartInView]:
    intrinsics, global_from_camera, image_size = view
    camera_from_global = inverse(global_from_camera)
    planes, facing = face_planes(camera_from_global @ parts.global_from_part, parts.size_wlh, intrinsics)
    found = []
    for index, corners in enumerate(transform_points(camera_from_global, parts.corners())):
        shape = silhouette(corners, intrinsics, image_size)
        if shape is not None and facing[index].any():
            nearest_m, farthest_m = max(float(corners[:, 2].min()), NEAR_M), float(corners[:, 2].max())
            solid, front = int(parts.solid_index[index]), planes[index, facing[index]]
            found.append(_PartInView(solid, shape, front, nearest_m, farthest_m))
    return found
