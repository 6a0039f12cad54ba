"""Plane projective maps as tensors, in batches; never an exception for a matrix that has no inverse."""

import torch
from torch import Tensor

_LEAST_DETERMINANT = 1e-7
"""Of a homography of norm 1 between normalised points."""


def unit_h33(homography: Tensor) -> Tensor:
    """(B, 3, 3) scaled to |h33| = 1; the sign stays."""
    return homography / homography[:, 2:, 2:].abs()


def inverse_or_nan(matrices: Tensor) -> Tensor:
    """Inverses of (B, 3, 3) matrices; NaN where one is singular or not finite."""
    identity = torch.eye(3, dtype=matrices.dtype, device=matrices.device)
    known = matrices.detach()
    finite = torch.isfinite(known).all(-1).all(-1)
    found, info = torch.linalg.inv_ex(torch.where(finite[:, None, None], known, identity))
    regular = (finite & (info == 0) & torch.isfinite(found).all(-1).all(-1))[:, None, None]
    # Inverted again without the others, whose gradients would be NaN even where nothing depends on them.
    inverse = torch.linalg.inv_ex(torch.where(regular, matrices, identity)).inverse
    return torch.where(regular, inverse, torch.nan)


def apply(homography: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
    """(B, 3, 3) on points (N, 2) or (B, N, 2): (B, N, 2) where they go, and (B, N) third coordinates."""
    mapped = points @ homography[:, :, :2].transpose(1, 2) + homography[:, None, :, 2]
    return mapped[..., :2] / mapped[..., 2:], mapped[..., 2]


def through_four_points(source: Tensor, destination: Tensor) -> Tensor:
    """The homographies that take four points to four others (Hartley & Zisserman, 2.3).

    Coordinates are relative to the points' mean, where w is made 1: if all four are in front of the camera,
    so is their mean. That fixes scale and sign, and excludes no homography, as h33 = 1 would.

    Args:
        source: (B, 4, 2) float64.
        destination: (B, 4, 2) float64.

    Returns:
        (B, 3, 3) float64; NaN where three points are on a line, or one is not finite.
    """
    normal_from_source, source = _normalised(source)
    normal_from_destination, destination = _normalised(destination)
    row = torch.cat([source, torch.ones_like(source[..., :1])], dim=-1)
    empty = torch.zeros_like(row)
    x, y = destination[..., :1], destination[..., 1:]
    equations = torch.cat(
        [torch.cat([row, empty, -x * source], dim=-1), torch.cat([empty, row, -y * source], dim=-1)], dim=1
    )
    entries, _ = torch.linalg.solve_ex(equations, torch.cat([x, y], dim=1))
    matrix = torch.cat([entries[..., 0], torch.ones_like(x[:, 0])], dim=-1).reshape(-1, 3, 3)
    known = matrix.detach()
    # Rounding hides that a matrix is singular, but for its size.
    regular = torch.linalg.det(known / known.flatten(1).norm(dim=1)[:, None, None]).abs() > _LEAST_DETERMINANT
    result = inverse_or_nan(normal_from_destination) @ matrix @ normal_from_source
    return torch.where(regular[:, None, None], result, torch.nan)


def _normalised(points: Tensor) -> tuple[Tensor, Tensor]:
    """(B, 3, 3) that moves (B, N, 2) points to mean 0 and spread 1, and the moved points."""
    mean = points.mean(1, keepdim=True)
    spread = (points - mean).square().mean((1, 2), keepdim=True).sqrt()
    similarity = torch.zeros(len(points), 3, 3, dtype=points.dtype, device=points.device)
    similarity[:, 0, 0] = similarity[:, 1, 1] = 1 / spread[:, 0, 0]
    similarity[:, :2, 2] = -(mean / spread)[:, 0]
    similarity[:, 2, 2] = 1.0
    return similarity, (points - mean) / spread
