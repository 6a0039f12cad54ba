"""Boxes, drawn into an image over a buffer of inverse depths."""

import numpy as np

from ogmkit.geometry.se3 import transform_points
from ogmkit.synthetic.blending import blend, hazed
from ogmkit.synthetic.palette import Palette
from ogmkit.synthetic.parts import Parts
from ogmkit.synthetic.silhouettes import coverage, face_planes, silhouette
from ogmkit.synthetic.surfaces import Surface, surface_colours
from ogmkit.synthetic.terrain import depth_from_inverse
from ogmkit.synthetic.view import View
from ogmkit.typing import Float32Array

# Boxes stand on the ground, and parts of a tree touch: of equal depths the one drawn later wins.
_DEPTH_TOLERANCE = np.float32(1e-3)


def draw_parts(
    image: Float32Array, inverse_depth: Float32Array, parts: Parts, view: View, palette: Palette
) -> None:
    """Draw boxes in place, far ones first, and enter them into the buffer of inverse depths.

    Args:
        image: (h, w, 3) with what is behind.
        inverse_depth: (h, w) of what is behind, in 1/m.
        parts: the boxes.
        view: the camera.
        palette: light and haze.
    """
    camera_from_part = view.camera_from_global @ parts.global_from_part
    corners = transform_points(view.camera_from_global, parts.corners())
    planes, facing = face_planes(camera_from_part, parts.size_wlh, view.intrinsics)
    distance = np.linalg.norm(camera_from_part[:, :3, 3], axis=1)
    for index in np.argsort(-distance, kind="stable"):
        shape = silhouette(corners[index], view.intrinsics, view.image_size)
        faces = np.flatnonzero(facing[index])
        if shape is None or len(faces) == 0:
            continue
        surface = Surface(
            parts.global_from_part[index],
            parts.size_wlh[index, [1, 0, 2]],
            parts.look[index],
            parts.colour_bgr[index],
            faces,
            planes[index, faces],
            shape.window,
        )
        inverse_depths = surface.inverse_depths()
        nearest = inverse_depths.min(axis=0)
        inside, behind = coverage(shape), inverse_depth[shape.window.slices]
        seen = nearest * (1 + _DEPTH_TOLERANCE) > behind
        colour = surface_colours(surface, inverse_depths, view, palette)
        colour = hazed(colour, depth_from_inverse(nearest), palette)
        blend(image[shape.window.slices], colour, inside * seen)
        np.copyto(behind, nearest, where=seen & (inside > 0.5))
