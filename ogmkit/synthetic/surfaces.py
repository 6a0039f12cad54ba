"""The painted sides of one box, as they appear in a window of the image."""

from dataclasses import dataclass

import cv2
import numpy as np

from ogmkit.synthetic.blending import three_channels
from ogmkit.synthetic.facades import Facade, facade
from ogmkit.synthetic.palette import Palette
from ogmkit.synthetic.silhouettes import FACE_NORMALS, NEAR_M, Window
from ogmkit.synthetic.view import View
from ogmkit.typing import Float32Array, FloatArray, IntArray

# Unit vectors along a face's width and height in the box's frame, to the right and down as seen from outside.
_RIGHT = np.array([[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, -1, 0]], dtype=np.float64)
_DOWN = np.array([[0, 0, -1], [0, 0, -1], [0, 0, -1], [0, 0, -1], [-1, 0, 0], [1, 0, 0]], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Surface:
    """The sides of a box that face the camera.

    Attributes:
        global_from_box: (4, 4).
        size_xyz: (3,) metres.
        look: what covers it, as in `parts.Parts`.
        colour_bgr: (3,) paint.
        faces: (F,) numbers of the facing sides, as in `silhouettes.FACE_NORMALS`.
        planes: (F, 3) their inverse depths, as in `silhouettes.face_planes`.
        window: the pixels to draw.
    """

    global_from_box: FloatArray
    size_xyz: FloatArray
    look: str
    colour_bgr: FloatArray
    faces: IntArray
    planes: FloatArray
    window: Window

    def inverse_depths(self) -> Float32Array:
        """(F, h, w) 1/depth of the sides' planes; the box itself is at the smallest."""
        return np.stack([self.window.affine(plane) for plane in self.planes])


def surface_colours(
    surface: Surface, inverse_depths: Float32Array, view: View, palette: Palette
) -> Float32Array:
    """Colours (h, w, 3) of the sides, blended over one pixel where two of them meet."""
    total = np.zeros((*inverse_depths.shape[1:], 3), np.float32)
    weights = np.zeros(inverse_depths.shape[1:], np.float32)
    for position, face in enumerate(surface.faces.tolist()):
        weight = np.ones_like(weights)
        for other in range(len(surface.faces)):
            if other != position:
                slope = np.hypot(*(surface.planes[other] - surface.planes[position])[:2]) + 1e-12
                margin_px = (inverse_depths[other] - inverse_depths[position]) * np.float32(1 / slope)
                np.minimum(weight, np.clip(margin_px + np.float32(0.5), 0, 1), out=weight)
        total += three_channels(weight) * _face_colours(surface, face, view, palette)
        weights += weight
    total /= three_channels(np.maximum(weights, np.float32(1e-6)))
    return total


def _face_colours(surface: Surface, face: int, view: View, palette: Palette) -> Float32Array:
    """The texture of one side's plane (h, w, 3), lit but without haze."""
    image_from_face = _image_from_face(surface, face, view)
    texture, texel_from_face = _texture(surface, face, image_from_face)
    image_from_window = np.array([[1.0, 0, surface.window.left], [0, 1, surface.window.top], [0, 0, 1]])
    light = _light(surface.global_from_box[:3, :3] @ FACE_NORMALS[face], palette)
    warped = cv2.warpPerspective(
        np.clip(texture.painted(surface.colour_bgr) * light, 0, 255).astype(np.uint8),
        texel_from_face @ np.linalg.inv(image_from_face) @ image_from_window,
        (surface.window.right - surface.window.left, surface.window.bottom - surface.window.top),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE if texture.repeat_m is None else cv2.BORDER_WRAP,
    )
    return np.asarray(warped, dtype=np.float32)


def _image_from_face(surface: Surface, face: int, view: View) -> FloatArray:
    """Homography (3, 3) from a side to the image; on the side (0, 0) is upper left and (1, 1) lower right."""
    right, down = _RIGHT[face] * surface.size_xyz, _DOWN[face] * surface.size_xyz
    corner = (FACE_NORMALS[face] * surface.size_xyz - right - down) / 2
    box_from_face = np.vstack([np.column_stack([right, down, corner]), [0, 0, 1]])
    camera_from_face = view.camera_from_global @ surface.global_from_box @ box_from_face
    homography: FloatArray = view.intrinsics @ camera_from_face[:3]
    return homography


def _texture(surface: Surface, face: int, image_from_face: FloatArray) -> tuple[Facade, FloatArray]:
    """The reduced copy of the texture with about one texel a pixel, and its (3, 3) `texel_from_face`."""
    levels = facade(surface.look, face)
    copies = np.ones(2)
    if levels[0].repeat_m is not None:
        extent_m = np.array([np.abs(_RIGHT[face] @ surface.size_xyz), np.abs(_DOWN[face] @ surface.size_xyz)])
        copies = np.maximum(np.round(extent_m / levels[0].repeat_m), 1)
    texels = copies * levels[0].opacity.shape[::-1]
    level = np.round((np.log2(texels.prod()) - np.log2(_area_px(image_from_face))) / 2)
    texture = levels[int(np.clip(level, 0, len(levels) - 1))]
    columns, rows = copies * texture.opacity.shape[::-1]
    return texture, np.array([[columns, 0, -0.5], [0, rows, -0.5], [0, 0, 1]])


def _area_px(image_from_face: FloatArray) -> float:
    """Area of a side in the image; infinite where it reaches behind the camera."""
    corners = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]]) @ image_from_face.T
    if corners[:, 2].min() < NEAR_M:
        return np.inf
    pixels = corners[:, :2] / corners[:, 2:]
    (u1, v1), (u2, v2) = pixels[2] - pixels[0], pixels[3] - pixels[1]
    return max(float(abs(u1 * v2 - u2 * v1)) / 2, 1.0)


def _light(normal: FloatArray, palette: Palette) -> float:
    """Brightness of a surface; level ground in full light has 1."""
    sun = np.array(palette.sun_direction)
    direct = min(max(float(normal @ sun) / sun[2], 0.0), 1.2)
    diffuse = 0.9 + 0.1 * float(normal[2])
    return float((1 - 0.5 * palette.sun_strength) * diffuse + 0.5 * palette.sun_strength * direct)
