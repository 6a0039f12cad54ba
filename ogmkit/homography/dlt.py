"""Homographies from point pairs: the normalised direct linear transformation, and its refinement."""

import numpy as np

from ogmkit.homography.corners import shortcomings, usable_corners
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.least_squares import homography_model, homography_of, minimise, parameters_of
from ogmkit.homography.projective import inverse_or_nan, normalisation, similar
from ogmkit.homography.result import Estimates, estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import FloatArray, IntArray

LEAST_POINTS = 4
# Of the normalised system: at least 3e-3 for the corners of one car on real frames; exactly degenerate sets
# leave rounding, at most 2e-15.
_MIN_CONDITION = 1e-9
_REFINING_STEPS = 12


def direct_linear_transformation(
    source: FloatArray, destination: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve for homographies by the normalised DLT (Hartley & Zisserman, algorithm 4.2).

    Args:
        source: (N, 2) or (B, N, 2) points.
        destination: (N, 2) or (B, N, 2) points.
        weights: (B, N), not negative, of the squared algebraic error; 0 leaves a point out.

    Returns:
        (B, 3, 3) `destination_from_source` of unit norm in normalised coordinates and any sign, and (B,) the
        system's conditioning: its eighth singular value over its first, or the smallest over the largest of
        the solution itself if that is less. Near 0 = degenerate.
    """
    source_norm = normalisation(source, weights)
    destination_norm = normalisation(destination, weights)
    system = design_matrix(similar(source_norm, source), similar(destination_norm, destination), weights)
    _, singular, right = np.linalg.svd(system, full_matrices=False)
    solution = right[:, 8].reshape(-1, 3, 3)
    values = np.linalg.svd(solution, compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.minimum(singular[:, 7] / singular[:, 0], values[:, 2] / values[:, 0])
    matrix = np.asarray(np.linalg.solve(destination_norm, solution @ source_norm), dtype=np.float64)
    return matrix, np.nan_to_num(condition)


def design_matrix(source: FloatArray, destination: FloatArray, weights: FloatArray) -> FloatArray:
    """The DLT's system of two rows a point, at least nine rows (Hartley & Zisserman, equation 4.3).

    Args:
        source: (B, N, 2), normalised.
        destination: (B, N, 2), normalised.
        weights: (B, N).

    Returns:
        (B, max(2N, 9), 9) float64.
    """
    batch, count = weights.shape
    # Four points give eight rows; the padding makes a thin SVD return the null vector too.
    system = np.zeros((batch, max(2 * count, 9), 9))
    rows = system[:, : 2 * count].reshape(batch, count, 2, 9)
    root = np.sqrt(weights)[..., None]
    ray = np.concatenate([source * root, root], axis=-1)
    rows[:, :, 0, 3:6] = -ray
    rows[:, :, 0, 6:9] = destination[..., 1:] * ray
    rows[:, :, 1, 0:3] = ray
    rows[:, :, 1, 6:9] = -destination[..., :1] * ray
    return system


def refine(
    homography: FloatArray,
    source: FloatArray,
    destination: FloatArray,
    weights: FloatArray,
    *,
    soft_l1: FloatArray | None = None,
) -> FloatArray:
    """Refine homographies to the least distance in the destination plane.

    With noise in the destination only, this is the maximum-likelihood estimate (Hartley & Zisserman, 4.2.3).

    Args:
        homography: (B, 3, 3) `destination_from_source`, the start.
        source: (N, 2).
        destination: (N, 2).
        weights: (B, N) of the squared distances.
        soft_l1: (B,) where the loss turns linear, in the destination's unit; None is least squares.

    Returns:
        (B, 3, 3) of any scale; NaN where the start is.
    """
    source_norm, destination_norm = normalisation(source, weights), normalisation(destination, weights)
    start = destination_norm @ homography @ inverse_or_nan(source_norm)
    model = homography_model(similar(source_norm, source), similar(destination_norm, destination))
    turn = None if soft_l1 is None else soft_l1 * destination_norm[:, 0, 0]
    refined = minimise(parameters_of(start), model, weights, steps=_REFINING_STEPS, soft_l1=turn)
    result = np.linalg.solve(destination_norm, homography_of(refined) @ source_norm)
    return np.asarray(result, dtype=np.float64)


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `dlt`: image → BEV over the ground corners of all usable boxes, the paper's direction."""
    corners = usable_corners(frame, settings)
    kept = corners.kept(left_out)
    reasons = shortcomings(corners, kept, settings.min_points or LEAST_POINTS, settings.min_spread_m)
    matrix, condition = direct_linear_transformation(corners.pixels, corners.positions_m, kept.astype(float))
    reasons = degeneracies(reasons, condition)
    return estimates(matrix, reasons, kept.sum(axis=1), corners.pixels, kept)


def degeneracies(reasons: list[str], condition: FloatArray) -> list[str]:
    """Add the refusal of badly conditioned systems to B reasons known so far."""
    degenerate = "the corners are degenerate (three in a line, or too close together)"
    return [
        reason or (degenerate if value < _MIN_CONDITION else "")
        for reason, value in zip(reasons, condition.tolist(), strict=True)
    ]
