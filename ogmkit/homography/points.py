"""A homography from point pairs of your own."""

import numpy as np
from numpy.typing import ArrayLike

from ogmkit.errors import SettingsError
from ogmkit.homography.dlt import LEAST_POINTS, degeneracies, direct_linear_transformation
from ogmkit.homography.projective import apply
from ogmkit.typing import FloatArray

_MIN_SCALE = 1e-12
"""Share of the largest entry that h33 must have to serve as the scale."""


def homography_from_points(source: ArrayLike, destination: ArrayLike) -> FloatArray:
    """The homography that maps points to points, by the normalised DLT over all of them.

    From pixels to cells it is a `bev_from_image`, as `warp_to_bev` and `warp_to_image` take it.

    Args:
        source: (N, 2) points of one plane, such as pixels (u, v); N ≥ 4.
        destination: (N, 2) the same points in the other plane, such as cells (column, row).

    Returns:
        (3, 3) float64 `destination_from_source` with |h33| = 1 and w > 0 at the points.

    Raises:
        SettingsError: shapes disagree, there are fewer than four points, a number is not finite, the points
            are degenerate, or the horizon would run through them or through (0, 0).
    """
    points, others = (np.asarray(given, dtype=np.float64) for given in (source, destination))
    _require_points(points, others)
    matrices, condition = direct_linear_transformation(points, others, np.ones((1, len(points))))
    reason = degeneracies([""], condition)[0]
    if reason:
        raise SettingsError(f"homography: {reason}")
    return _signed(matrices[0], points)


def _require_points(source: FloatArray, destination: FloatArray) -> None:
    if source.shape != destination.shape or source.ndim != 2 or source.shape[1] != 2:
        shapes = f"{source.shape} and {destination.shape}"
        raise SettingsError(f"homography: points have shapes {shapes}, expected (N, 2) twice")
    if len(source) < LEAST_POINTS:
        raise SettingsError(f"homography: {len(source)} points, fewer than {LEAST_POINTS}")
    if not (np.isfinite(source).all() and np.isfinite(destination).all()):
        raise SettingsError("homography: a point holds a number that is not finite")


def _signed(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """The matrix at its scale, w > 0 at the points."""
    if abs(matrix[2, 2]) < _MIN_SCALE * np.abs(matrix).max():
        raise SettingsError("homography: the horizon runs through (0, 0) of the source plane")
    _, w = apply(matrix, points)
    if not ((w > 0).all() or (w < 0).all()):
        raise SettingsError("homography: the horizon would run through the points")
    result: FloatArray = matrix * (np.sign(w[0]) / abs(matrix[2, 2]))
    return result
