"""Levenberg–Marquardt on many small problems at once, with weights and a robust loss."""

from collections.abc import Callable

import numpy as np

from ogmkit.homography.projective import apply
from ogmkit.typing import FloatArray

Model = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""(B, P) parameters → (B, N, 2) residuals and (B, N, 2, P) their derivatives; not finite = not allowed."""


def minimise(
    start: FloatArray, model: Model, weights: FloatArray, *, steps: int, soft_l1: FloatArray | None = None
) -> FloatArray:
    """Minimise Σ weight · ρ(|residual|²) for each problem of a batch (Hartley & Zisserman, A6.2).

    Args:
        start: (B, P) float64.
        model: residuals and their derivatives.
        weights: (B, N), not negative; points of weight 0 may have residuals that are not finite.
        steps: number of steps, always all of them: the same input gives the same result.
        soft_l1: (B,) where the loss turns from quadratic to linear, ρ = 2·c²·(√(1 + |r|²/c²) − 1), in the
            residual's unit; None is least squares.

    Returns:
        (B, P) parameters, never worse than the start.
    """
    parameters = start
    residual, jacobian = model(parameters)
    cost = _cost(residual, weights, soft_l1)
    damping = np.full(len(start), 1e-4)
    for _ in range(steps):
        step = _step(residual, jacobian, _reweighted(residual, weights, soft_l1), damping)
        tried = parameters + step
        new_residual, new_jacobian = model(tried)
        new_cost = _cost(new_residual, weights, soft_l1)
        better = new_cost < cost
        parameters = np.where(better[:, None], tried, parameters)
        residual = np.where(better[:, None, None], new_residual, residual)
        jacobian = np.where(better[:, None, None, None], new_jacobian, jacobian)
        cost = np.where(better, new_cost, cost)
        damping = np.where(better, damping * 0.1, damping * 10)
    return parameters


def homography_model(source: FloatArray, destination: FloatArray) -> Model:
    """Model whose eight parameters are a homography's entries row by row, h33 = 1.

    Args:
        source: (B or 1, N, 2), normalised.
        destination: (B or 1, N, 2), normalised; residuals are mapped source − destination.
    """

    def model(parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        mapped, w = apply(homography_of(parameters), source)
        with np.errstate(divide="ignore", invalid="ignore"):
            ray = (
                np.concatenate([np.broadcast_to(source, mapped.shape), np.ones((*w.shape, 1))], -1)
                / w[..., None]
            )
        jacobian = np.zeros((*mapped.shape, 8))
        jacobian[..., 0, 0:3] = ray
        jacobian[..., 1, 3:6] = ray
        jacobian[..., 6:8] = -mapped[..., None] * ray[..., None, :2]
        return mapped - destination, jacobian

    return model


def parameters_of(homography: FloatArray) -> FloatArray:
    """(B, 8) parameters of (B, 3, 3) matrices; NaN where h33 = 0, which no sound start has.

    Normalised points lie round the origin, in front of the horizon, and w there is h33.
    """
    scale = homography[:, 2:, 2:]
    scaled: FloatArray = homography / np.where(scale == 0, np.nan, scale)
    return scaled.reshape(-1, 9)[:, :8]


def homography_of(parameters: FloatArray) -> FloatArray:
    """(B, 8) parameters as (B, 3, 3) matrices with h33 = 1."""
    ones = np.ones((len(parameters), 1))
    return np.concatenate([parameters, ones], axis=1).reshape(-1, 3, 3)


def _squares(residual: FloatArray) -> FloatArray:
    squares: FloatArray = np.einsum("bni,bni->bn", residual, residual)
    return squares


def _cost(residual: FloatArray, weights: FloatArray, soft_l1: FloatArray | None) -> FloatArray:
    """(B,) cost; infinite where a point that counts has a residual that is not finite."""
    loss = _squares(residual)
    if soft_l1 is not None:
        turn = soft_l1[:, None] ** 2
        loss = 2 * turn * (np.sqrt(1 + loss / turn) - 1)
    counted = np.where(weights > 0, weights * loss, 0.0).sum(-1)
    return np.where(np.isfinite(counted), counted, np.inf)


def _reweighted(residual: FloatArray, weights: FloatArray, soft_l1: FloatArray | None) -> FloatArray:
    if soft_l1 is None:
        return weights
    factor: FloatArray = weights / np.sqrt(1 + _squares(residual) / soft_l1[:, None] ** 2)
    return factor


def _step(residual: FloatArray, jacobian: FloatArray, weights: FloatArray, damping: FloatArray) -> FloatArray:
    """(B, P) damped Gauss–Newton steps; 0 where the start itself is not finite."""
    batch, count = len(jacobian), jacobian.shape[-1]
    root = np.sqrt(weights)[..., None]
    usable = (weights > 0)[..., None]
    rows = np.where(usable[..., None], jacobian * root[..., None], 0.0).reshape(batch, -1, count)
    sides = np.where(usable, residual * root, 0.0).reshape(batch, -1, 1)
    rows_t = np.swapaxes(rows, 1, 2)
    normal = rows_t @ rows
    diagonal = np.einsum("bii->bi", normal)
    # A parameter that nothing depends on keeps its value.
    floor = np.finfo(np.float64).eps * np.maximum(diagonal.max(-1, initial=0.0), 1.0)
    diagonal += damping[:, None] * diagonal + floor[:, None]
    gradient = rows_t @ sides
    finite = np.isfinite(normal).all((1, 2)) & np.isfinite(gradient).all((1, 2))
    normal[~finite], gradient[~finite] = np.eye(count), 0.0
    step: FloatArray = -np.linalg.solve(normal, gradient)[..., 0]
    return step
