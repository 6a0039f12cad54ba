"""Drivable area laid on ground that is not flat, as the camera sees it."""

from collections.abc import Callable

import cv2
import numpy as np

from ogmkit.footprints.view import View
from ogmkit.footprints.warp import require_warpable
from ogmkit.grid import GridSpec
from ogmkit.typing import Float32Array, FloatArray, UInt8Array

HeightFunction = Callable[[FloatArray], FloatArray]
"""Height of the ground, z of the level frame in metres, at (S, 2) places x, y of it."""

# How finely the ground is cut; on a plane the answer is exact whatever these are.
_NEAREST_M = 0.25
_RATIO = 1.04  # of successive distances along a section: the ground bends little over 4 % of its distance
_BETWEEN_SECTIONS = 0.05  # to the side by metre ahead: 3°
_LINES_PER_PX = 2  # of sight, in each section: so sharp are crests
_HORIZON = 100.0  # distance at which the ground ends, in those of the grid's farthest corner
_STEEPEST = 12.0  # of a ray, by metre ahead: 85°


def project_drivable(
    drivable: UInt8Array, grid: GridSpec, height_m: HeightFunction, view: View
) -> UInt8Array:
    """Render the drivable raster on the ground; ground behind a crest stays hidden.

    Each pixel shows the nearest cell to where its ray first meets the ground.

    Args:
        drivable: (rows, columns) uint8 0/1.
        grid: its grid.
        height_m: the ground's height.
        view: the camera; only ground ahead, where it looks, is drawn.

    Returns:
        (height, width) uint8 0/1.

    Raises:
        SettingsError: the raster is too long for OpenCV.
    """
    require_warpable(drivable.shape)
    origin, level_from_ahead = view.level_from_camera[:3, 3], _level_from_ahead(view)
    rays = level_from_ahead.T @ view.level_from_camera[:3, :3] @ np.linalg.inv(view.intrinsics)

    def rise_m(places_m: FloatArray) -> FloatArray:
        rise: FloatArray = height_m(origin[:2] + places_m @ level_from_ahead[:2, :2].T) - origin[2]
        return rise

    inverse_m = _inverse_distances(rise_m, rays, view.image_size, _farthest_m(grid, origin))
    ahead = _affine(rays[0], view.image_size)
    met = (ahead > 0) & (inverse_m > 0)
    # Where no ground is met, the ray is left without length, and its pixel is emptied at the end.
    stretch_m = np.divide(1, ahead * inverse_m, out=np.zeros_like(ahead), where=met)
    across, along = (grid.bev_from_level[:2, :2] @ level_from_ahead[:2, :2]) @ rays[:2]
    column, row = grid.cells(origin).astype(np.float32)
    columns = column + stretch_m * _affine(across, view.image_size)
    rows = row + stretch_m * _affine(along, view.image_size)
    shown = cv2.remap(drivable, columns, rows, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return shown.astype(np.uint8, copy=False) * met


def _level_from_ahead(view: View) -> FloatArray:
    """(3, 3) rotation about z, from axes whose x is where the camera looks over the ground."""
    x, y = view.level_from_camera[:2, 2]
    length = np.hypot(x, y)
    cos, sin = (x / length, y / length) if length > 0 else (1.0, 0.0)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _farthest_m(grid: GridSpec, origin: FloatArray) -> float:
    """Distance from the camera to the grid's farthest corner, over the ground."""
    reach_m = np.abs(np.array([grid.x_range_m, grid.y_range_m]) - origin[:2, None]).max(axis=1)
    return float(np.hypot(*reach_m))


def _inverse_distances(
    rise_m: HeightFunction, rays: FloatArray, image_size: tuple[int, int], farthest_m: float
) -> Float32Array:
    """One over the distance ahead at which each pixel's ray first meets the ground; 0 for none.

    Vertical planes through the camera cut the ground; along each section, the steepest line of sight so far
    hides what lies below it. With t and s a ray's parts to the left and up by metre ahead, 1 / distance is
    linear in (t, s) on any plane, and (t, s) follow from the pixel by a homography. So few sections, with a
    table of lines of sight in each, and one warp of it give all pixels.

    Args:
        rise_m: the ground's height over the camera at (S, 2) places, ahead and left of the camera.
        rays: (3, 3) ahead, left and up, from pixels (u, v, 1).
        image_size: (height, width).
        farthest_m: how far ahead the ground is looked for.

    Returns:
        (height, width) float32, meaningful only for rays that lead ahead.
    """
    height, width = image_size
    low, high = _steepness(rays, image_size)
    left = np.linspace(low[0], high[0], 2 + int((high[0] - low[0]) / _BETWEEN_SECTIONS))
    up = np.linspace(low[1], high[1], 2 + height * _LINES_PER_PX)
    steps = 2 + int(np.log(max(farthest_m, _NEAREST_M) / _NEAREST_M) / np.log(_RATIO))
    # The last place is as good as infinitely far: 1 / distance is linear up to the horizon, too.
    ahead_m = np.append(_NEAREST_M * _RATIO ** np.arange(steps), _HORIZON * farthest_m)
    places_m = ahead_m[:, None] * np.stack([np.ones_like(left), left], axis=-1)[:, None]
    rise = rise_m(places_m.reshape(-1, 2)).reshape(places_m.shape[:2])
    sight = np.maximum.accumulate(rise / ahead_m, axis=1)
    table = np.array([np.interp(up, section, 1 / ahead_m, right=0.0) for section in sight], dtype=np.float32)
    step_up, step_left = up[1] - up[0], left[1] - left[0]
    entry_from_slope = np.array(
        [[1 / step_up, 0, -up[0] / step_up], [0, 1 / step_left, -left[0] / step_left], [0, 0, 1]]
    )
    table_from_image = entry_from_slope @ rays[[2, 1, 0]]
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    inverse_m = cv2.warpPerspective(table, table_from_image, (width, height), flags=flags)
    return inverse_m.astype(np.float32, copy=False)


def _steepness(rays: FloatArray, image_size: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """Least and greatest (t, s) in the image, half a pixel beyond its outer pixels' centres."""
    height, width = image_size
    u, v = np.array([-0.5, width - 0.5]), np.array([-0.5, height - 0.5])
    corners = rays @ np.array([[*u, *u], [*v, *v[::-1]], [1, 1, 1, 1]])
    if (corners[0] <= 0).any():
        return np.full(2, -_STEEPEST), np.full(2, _STEEPEST)
    slopes = corners[1:] / corners[0]
    return slopes.min(axis=1).clip(-_STEEPEST, None), slopes.max(axis=1).clip(None, _STEEPEST)


def _affine(coefficients: FloatArray, image_size: tuple[int, int]) -> Float32Array:
    """(height, width) a·u + b·v + c at every pixel."""
    a, b, c = coefficients
    u, v = np.arange(image_size[1]), np.arange(image_size[0])
    result: Float32Array = (a * u).astype(np.float32) + (b * v + c).astype(np.float32)[:, None]
    return result
