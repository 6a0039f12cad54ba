"""Shadows on the ground: where solids keep the sun off, and the dark line where they stand."""

import cv2
import numpy as np

from ogmkit.geometry.boxes import box_corners
from ogmkit.geometry.se3 import transform_points
from ogmkit.synthetic.blending import three_channels
from ogmkit.synthetic.palette import Palette
from ogmkit.synthetic.parts import Parts
from ogmkit.synthetic.silhouettes import coverage, silhouette
from ogmkit.synthetic.terrain import FARTHEST_M
from ogmkit.synthetic.view import View
from ogmkit.typing import Float32Array, FloatArray

_REACH_M = 90.0
_CONTACT_GAP_M, _CONTACT_MARGIN_M, _CONTACT_DARKNESS = 0.3, 0.12, 0.45
_SUN_BLUR_M = 0.08


def draw_shadows(
    image: Float32Array, inverse_depth: Float32Array, parts: Parts, view: View, palette: Palette
) -> None:
    """Darken the ground in place: below each solid, and where it keeps the sun off.

    Args:
        image: (h, w, 3) with sky and ground.
        inverse_depth: (h, w) of the ground.
        parts: the boxes that throw shadows.
        view: the camera.
        palette: the sun.
    """
    lit = np.ones(view.image_size, np.float32)
    corners = parts.corners()
    near = np.hypot(*(corners.mean(axis=1) - view.origin)[:, :2].T) < _REACH_M
    sun = np.array(palette.sun_direction)
    ground = view.ground_height(parts.global_from_part[:, :2, 3])
    for index in np.flatnonzero(near):
        floor = ground[index]
        rise = corners[index, :, 2:] - floor
        _darken(
            lit, corners[index] - rise * sun / sun[2], view, 0.5 * palette.sun_strength, blur_m=_SUN_BLUR_M
        )
        if rise.min() < _CONTACT_GAP_M:
            margin = np.array([2 * _CONTACT_MARGIN_M, 2 * _CONTACT_MARGIN_M, 0.0])
            size = (parts.size_wlh[index] + margin) * [1, 1, 0]
            base = box_corners(parts.global_from_part[index][None], size[None])[0]
            base[:, 2] = floor
            _darken(lit, base, view, _CONTACT_DARKNESS, blur_m=4 * _CONTACT_MARGIN_M)
    lit[inverse_depth <= 1 / FARTHEST_M] = 1
    image *= three_channels(lit)


def _darken(lit: Float32Array, corners: FloatArray, view: View, darkness: float, blur_m: float) -> None:
    """Lower the light (h, w) in place within the outline of a flattened box, (8, 3) corners in `global`."""
    corners_camera = transform_points(view.camera_from_global, corners)
    distance_m = max(float(corners_camera[:, 2].mean()), 1.0)
    across_px = max(blur_m * view.intrinsics[0, 0] / distance_m, 1.0)
    # Seen at a slant, a blurred rim is foreshortened along the view.
    along_px = max(across_px * min(view.height_above_ground_m / distance_m, 1.0), 1.0)
    shape = silhouette(corners_camera, view.intrinsics, view.image_size, across_px)
    if shape is None:
        return
    kernel = (round(across_px), round(along_px))
    soft = cv2.blur(coverage(shape), kernel, borderType=cv2.BORDER_REPLICATE)
    target = lit[shape.window.slices]
    np.minimum(target, 1 - np.float32(darkness) * soft, out=target)
