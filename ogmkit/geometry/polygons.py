"""Clipping of polygons against half-spaces, in any number of dimensions (Sutherland & Hodgman, 1974)."""

import numpy as np

from ogmkit.typing import FloatArray


def clip_half_space(polygon: FloatArray, signed_distance: FloatArray) -> FloatArray:
    """Keep the part of a polygon where a linear function of position is not negative.

    Args:
        polygon: (K, D) vertices in order.
        signed_distance: (K,) the function at the vertices.

    Returns:
        (J, D) float64, empty where nothing is left. A polygon that is not convex may come back with edges
        that run along the border there and back; the even-odd rule is blind to these.
    """
    inside = signed_distance >= 0
    if inside.all():
        return polygon
    following = np.roll(polygon, -1, axis=0)
    distance_following = np.roll(signed_distance, -1)
    crosses = inside != np.roll(inside, -1)
    span = np.where(crosses, signed_distance - distance_following, 1.0)
    border = polygon + (signed_distance / span)[:, None] * (following - polygon)
    candidates = np.stack([polygon, border], axis=1)
    kept: FloatArray = candidates[np.stack([inside, crosses], axis=1)]
    return kept


def clip_near_plane(polygon_camera: FloatArray, near_m: float) -> FloatArray:
    """Keep the part of a (K, 3) polygon of the camera frame at a depth of `near_m` or more.

    To be done before projection: behind the camera, lines do not project to lines that one sees.
    """
    return clip_half_space(polygon_camera, polygon_camera[:, 2] - near_m)


def clip_rectangle(polygon: FloatArray, lower: tuple[float, float], upper: tuple[float, float]) -> FloatArray:
    """Keep the part of a (K, 2) polygon between two opposite corners of an axis-aligned rectangle."""
    for axis in range(2):
        polygon = clip_half_space(polygon, polygon[:, axis] - lower[axis])
        polygon = clip_half_space(polygon, upper[axis] - polygon[:, axis])
    return polygon
