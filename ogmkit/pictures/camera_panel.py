"""The camera's picture: bare, with projected 3D boxes, or with masks over it."""

import numpy as np

from ogmkit.drawing.canvas import Canvas, fit, resize
from ogmkit.drawing.palette import Colour, theme
from ogmkit.geometry.boxes import EDGES, box_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.polygons import clip_near_plane
from ogmkit.pictures.views import View
from ogmkit.typing import FloatArray, UInt8Array

DRIVABLE_OPACITY, VEHICLE_OPACITY = 0.5, 0.75
"""Of masks over the image; their outlines are solid."""

_NEAR_M = 0.1
_CLOSE_M = 25.0
_FRONT_FACE = (0, 1, 2, 3)
_FRONT_OPACITY = 0.45


def draw_photo(view: View, size: tuple[int, int]) -> Canvas:
    """Draw the image, or an empty panel that says there is none.

    Args:
        view: the frame.
        size: largest (height, width) in pixels; the image keeps its shape.
    """
    height, width = fit(view.image_size, size)
    canvas = Canvas(height, width, theme().empty)
    if view.image is None:
        canvas.text("no image in the shard", width // 2, height // 5, 22, theme().muted, "centre")
    else:
        canvas.paste(resize(view.image, (height, width), photo=True), 0, 0)
    return canvas


def draw_masks(
    view: View,
    size: tuple[int, int],
    *,
    vehicles: UInt8Array,
    drivable: UInt8Array | None = None,
) -> Canvas:
    """Draw the image as `draw_photo` does, with masks over it.

    Args:
        view: the frame.
        size: largest (height, width) in pixels.
        vehicles: (h, w) uint8 0/1 of any size.
        drivable: the same; None leaves it out.
    """
    canvas = draw_photo(view, size)
    if drivable is not None:
        canvas.overlay(drivable, theme().drivable, DRIVABLE_OPACITY)
    canvas.overlay(vehicles, theme().vehicle, VEHICLE_OPACITY)
    return canvas


def draw_camera(view: View, size: tuple[int, int]) -> Canvas:
    """Draw the image as `draw_photo` does, and the boxes over it.

    Args:
        view: the frame.
        size: largest (height, width) in pixels.
    """
    canvas = draw_photo(view, size)
    panel_intrinsics = _panel_intrinsics(view, canvas.shape[0])
    corners = box_corners(view.camera_from_box, view.size_wlh)
    depths_m = view.camera_from_box[:, 2, 3]
    for box in np.argsort(-depths_m).tolist():
        colour = box_colour(view.category[box])
        _draw_box(canvas, corners[box], panel_intrinsics, colour, depths_m[box] < _CLOSE_M)
    return canvas


def box_colour(category: str) -> Colour:
    """Colour of the boxes of a category, by the first part of its name."""
    colours = theme()
    kinds = {"vehicle": colours.vehicle, "human": colours.second, "movable_object": colours.first}
    return kinds.get(category.partition(".")[0], colours.muted)


def _draw_box(
    canvas: Canvas, corners_camera: FloatArray, intrinsics: FloatArray, colour: Colour, close: bool
) -> None:
    """Draw the (8, 3) corners' edges, and the front face filled, as far as they lie before the camera."""
    front = clip_near_plane(corners_camera[list(_FRONT_FACE)], _NEAR_M)
    canvas.polygon(project(intrinsics, front)[0], colour, _FRONT_OPACITY)
    for edge in EDGES:
        visible = clip_near_plane(corners_camera[list(edge)], _NEAR_M)
        if len(visible):
            draw = canvas.cased_polyline if close else canvas.polyline
            draw(project(intrinsics, visible)[0], colour, 2 if close else 1)


def _panel_intrinsics(view: View, height: int) -> FloatArray:
    """Intrinsics of the scaled image; pixel centres at integers move by half a pixel less (design.md §1)."""
    scale = height / view.image_size[0]
    shift = (scale - 1) / 2
    panel_from_image = np.array([[scale, 0, shift], [0, scale, shift], [0, 0, 1]])
    scaled: FloatArray = panel_from_image @ view.intrinsics
    return scaled
