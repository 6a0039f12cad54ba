"""Rigid transforms as 4×4 float64 matrices named `destination_from_source`."""

import numpy as np
from numpy.typing import ArrayLike

from ogmkit.typing import FloatArray


def rotation_matrix(rotation_wxyz: ArrayLike) -> FloatArray:
    """Rotation matrices of quaternions, normalised first.

    Args:
        rotation_wxyz: (..., 4) quaternions in nuScenes order (w, x, y, z), none of them zero.

    Returns:
        (..., 3, 3) float64.
    """
    quaternion = np.asarray(rotation_wxyz, dtype=np.float64)
    w, x, y, z = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    entries = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in entries], axis=-2)


def pose_matrix(translation_m: ArrayLike, rotation_wxyz: ArrayLike) -> FloatArray:
    """Build transforms from translations and quaternions, as nuScenes stores poses.

    Args:
        translation_m: (..., 3) origin of the source frame in the destination frame, metres.
        rotation_wxyz: (..., 4) quaternions (w, x, y, z).

    Returns:
        (..., 4, 4) float64 `destination_from_source`.
    """
    translation = np.asarray(translation_m, dtype=np.float64)
    matrix = np.zeros((*translation.shape[:-1], 4, 4))
    matrix[..., :3, :3] = rotation_matrix(rotation_wxyz)
    matrix[..., :3, 3] = translation
    matrix[..., 3, 3] = 1.0
    return matrix


def inverse(destination_from_source: FloatArray) -> FloatArray:
    """`source_from_destination`, by transposing the rotation; (..., 4, 4) in and out."""
    rotation = np.swapaxes(destination_from_source[..., :3, :3], -1, -2)
    result = np.zeros_like(destination_from_source)
    result[..., :3, :3] = rotation
    result[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation, destination_from_source[..., :3, 3])
    result[..., 3, 3] = 1.0
    return result


def transform_points(destination_from_source: FloatArray, points_source: FloatArray) -> FloatArray:
    """Move points: (..., 4, 4) and (..., N, 3) in the source frame give (..., N, 3) in the destination."""
    rotation = destination_from_source[..., :3, :3]
    translation = destination_from_source[..., None, :3, 3]
    moved: FloatArray = points_source @ np.swapaxes(rotation, -1, -2) + translation
    return moved


def heading_rad(global_from_ego: FloatArray) -> FloatArray:
    """Heading about global z of (..., 4, 4) poses: where the x axis points on the map (design.md §1)."""
    heading: FloatArray = np.arctan2(global_from_ego[..., 1, 0], global_from_ego[..., 0, 0])
    return heading


def level_from_global(global_from_ego: FloatArray) -> FloatArray:
    """Transform into the `level` frame: the ego's origin and heading, z exactly up (design.md §1).

    Args:
        global_from_ego: (..., 4, 4) poses.

    Returns:
        (..., 4, 4) float64.
    """
    heading = heading_rad(global_from_ego)
    global_from_level = np.zeros(global_from_ego.shape)
    global_from_level[..., 0, 0] = global_from_level[..., 1, 1] = np.cos(heading)
    global_from_level[..., 1, 0] = np.sin(heading)
    global_from_level[..., 0, 1] = -np.sin(heading)
    global_from_level[..., 2, 2] = global_from_level[..., 3, 3] = 1.0
    global_from_level[..., :3, 3] = global_from_ego[..., :3, 3]
    return inverse(global_from_level)
