"""Plane projective maps on points, in batches."""

import numpy as np

from ogmkit.typing import FloatArray


def apply(homography: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Map points of the plane.

    Args:
        homography: (..., 3, 3) `destination_from_source`.
        points: (..., N, 2) in the source plane; leading axes broadcast.

    Returns:
        (..., N, 2) in the destination plane, meaningful only where w > 0 (for a matrix with the sign of
        design.md §2), and (..., N) w, the third homogeneous coordinate.
    """
    linear = np.swapaxes(homography[..., :2], -1, -2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        homogeneous = points @ linear + homography[..., None, :, 2]
        w = homogeneous[..., 2]
        mapped = homogeneous[..., :2] / w[..., None]
    return mapped, w


def normalisation(points: FloatArray, weights: FloatArray) -> FloatArray:
    """Similarity that moves points to mean 0 and mean distance √2 (Hartley & Zisserman, 4.4.4).

    Args:
        points: (..., N, 2).
        weights: (..., N), not negative; a point of weight 0 does not count.

    Returns:
        (..., 3, 3) float64; the identity's scale where all points coincide.
    """
    total = np.maximum(weights.sum(-1), np.finfo(np.float64).tiny)
    mean = (weights[..., None] * points).sum(-2) / total[..., None]
    offset = points - mean[..., None, :]
    distance = (weights * np.hypot(offset[..., 0], offset[..., 1])).sum(-1) / total
    scale = np.sqrt(2) / np.where(distance > 0, distance, np.sqrt(2))
    matrix = np.zeros((*mean.shape[:-1], 3, 3))
    matrix[..., 0, 0] = matrix[..., 1, 1] = scale
    matrix[..., :2, 2] = -scale[..., None] * mean
    matrix[..., 2, 2] = 1.0
    return matrix


def similar(similarity: FloatArray, points: FloatArray) -> FloatArray:
    """Move (N, 2) or (B, N, 2) points by (B, 3, 3) similarities without rotation: (B, N, 2)."""
    moved: FloatArray = points * similarity[:, 0, 0, None, None] + similarity[:, None, :2, 2]
    return moved


def inverse_or_nan(matrices: FloatArray) -> FloatArray:
    """Inverses of (B, 3, 3) matrices; NaN where one is singular or not finite."""
    regular = determinants(matrices) != 0
    inverse = np.full_like(matrices, np.nan)
    inverse[regular] = np.linalg.inv(matrices[regular])
    return inverse


def determinants(matrices: FloatArray) -> FloatArray:
    """(B,) determinants of (B, 3, 3) matrices; 0 where one is not finite."""
    finite = np.all(np.isfinite(matrices), axis=(-1, -2))
    values: FloatArray = np.linalg.det(np.where(finite[:, None, None], matrices, 0.0))
    return values
