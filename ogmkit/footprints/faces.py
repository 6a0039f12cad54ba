"""Faces of annotated boxes in the image: their own ground faces, or their whole bodies."""

from collections.abc import Iterable

import numpy as np

from ogmkit.footprints.view import View
from ogmkit.geometry.boxes import FACES, box_corners, ground_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.polygons import clip_near_plane, clip_rectangle
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import FloatArray, UInt8Array

NEAR_M = 0.1
"""Depth of the near plane, against which faces are cut before they are projected."""


def ground_faces(view: View, level_from_box: FloatArray, size_wlh: FloatArray) -> list[FloatArray]:
    """What the image shows of each box's ground face, were nothing before it.

    Args:
        view: the camera.
        level_from_box: (M, 4, 4).
        size_wlh: (M, 3) metres.

    Returns:
        M polygons (K, 2) in pixels (u, v), cut at the near plane, projected, cut at the image's border;
        of no vertices where nothing is seen.
    """
    return _visible(ground_corners(view.camera_from_level @ level_from_box, size_wlh), view)


def body_faces(view: View, level_from_box: FloatArray, size_wlh: FloatArray) -> list[FloatArray]:
    """The six faces of each whole box: 6·M polygons, as `ground_faces` has them.

    Together they are the box's outline, also where the near plane cuts it: what is seen through the cut is
    the far side.
    """
    corners = box_corners(view.camera_from_level @ level_from_box, size_wlh)
    return _visible(corners[:, FACES].reshape(-1, 4, 3), view)


def fill(polygons: Iterable[FloatArray], image_size: tuple[int, int]) -> UInt8Array:
    """The union of polygons as a (height, width) uint8 mask, by the centre rule."""
    return fill_polygons([polygon for polygon in polygons if len(polygon)], image_size)


def _visible(faces_camera: FloatArray, view: View) -> list[FloatArray]:
    """Cut (F, 4, 3) faces at the near plane, project them, cut them at the image's border."""
    height, width = view.image_size
    lower, upper = (-0.5, -0.5), (width - 0.5, height - 0.5)
    before = faces_camera[..., 2] >= NEAR_M
    pixels, _ = project(view.intrinsics, faces_camera)
    inside = (pixels >= lower) & (pixels <= upper)
    whole = np.all(before & inside.all(axis=-1), axis=1)
    polygons = [np.empty((0, 2))] * len(faces_camera)
    # Most faces are wholly inside the image, or behind the camera: clipping one by one is for the others.
    for index in np.flatnonzero(before.any(axis=1)):
        if whole[index]:
            polygons[index] = pixels[index]
        else:
            cut, _ = project(view.intrinsics, clip_near_plane(faces_camera[index], NEAR_M))
            polygons[index] = clip_rectangle(cut, lower, upper)
    return polygons
