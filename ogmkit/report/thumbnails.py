"""Small pictures of a frame, as text: WebP in base64, each within a bound of bytes."""

import base64
from collections.abc import Callable, Sequence

import cv2

from ogmkit.drawing.bev_panel import Plan, draw_paths, draw_plane, plan_for
from ogmkit.drawing.cells import target_colours
from ogmkit.drawing.palette import THEMES, themed
from ogmkit.grid import GridSpec
from ogmkit.pictures.camera_panel import draw_camera
from ogmkit.pictures.views import View
from ogmkit.typing import UInt8Array

PHOTO_BYTES, PLANE_BYTES = 5000, 2750
"""That a camera's picture, and a plane in one theme, may take."""
FRAME_CHARACTERS = 4 * (PHOTO_BYTES + len(THEMES) * PLANE_BYTES) // 3 + 16
"""That the pictures of a frame may take in the page, in base64."""

_PHOTO_SIZE, _PLANE_SIZE = (180, 320), (300, 240)
_QUALITIES = (60, 45, 30, 15, 1)
_SMALLER = 0.7


def frame_pictures(view: View, grid: GridSpec) -> list[str]:
    """The image with its boxes, then the plane in each theme of the palette."""
    plan = small_plan(view, grid)

    def draw() -> list[UInt8Array]:
        colours = target_colours(view.drivable, view.vehicles, view.field_of_view)
        plane = draw_plane(colours, plan)
        draw_paths(plane, view.past, view.future, plan)
        return [plane.pixels]

    return [encoded(draw_camera(view, _PHOTO_SIZE).pixels, PHOTO_BYTES), *in_themes(draw)]


def small_plan(view: View, grid: GridSpec) -> Plan:
    """Where the plane of a small picture shows what."""
    return plan_for(grid, [view.past], _PLANE_SIZE)


def in_themes(draw: Callable[[], Sequence[UInt8Array]]) -> list[str]:
    """The first plane in each theme of the palette, then the next one."""
    drawn = []
    for name in THEMES:
        with themed(name):
            drawn.append([encoded(plane, PLANE_BYTES) for plane in draw()])
    return [picture for plane in zip(*drawn, strict=True) for picture in plane]


def encoded(pixels: UInt8Array, most: int) -> str:
    """(h, w, 3) uint8 RGB as WebP of at most so many bytes, in base64: coarser, then smaller, to fit."""
    bgr = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
    while True:
        for quality in _QUALITIES:
            _, data = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, quality])
            if len(data) <= most:
                return base64.b64encode(data.tobytes()).decode()
        bgr = cv2.resize(bgr, None, fx=_SMALLER, fy=_SMALLER, interpolation=cv2.INTER_AREA)
