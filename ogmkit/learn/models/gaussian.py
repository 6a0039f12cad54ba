"""Bivariate Gaussians of positions: parametrisation and likelihood (paper, Cost function and learning)."""

import math
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional

FLOOR_M = 0.05
"""Least standard deviation: a surer planner would learn the noise of poses, by gradients without bound."""
_MOST_CORRELATED = 0.999


class Gaussians(NamedTuple):
    """Distributions of (B, T) positions.

    Attributes:
        mean: (B, T, 2), metres.
        sigma: (B, T, 2), metres: standard deviations of x and y.
        rho: (B, T), correlation of x and y, inside ±1.
    """

    mean: Tensor
    sigma: Tensor
    rho: Tensor


def gaussian_of(raw: Tensor, middle_m: Tensor, unit_m: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Mean, standard deviations and correlation of five numbers without bounds.

    Args:
        raw: (B, 5): mean of x and y from `middle_m` on, two for the standard deviations, all four in
            units of `unit_m`; one for the correlation.
        middle_m: (2,) or (B, 2) metres.
        unit_m: (2,) metres.

    Returns:
        (B, 2), (B, 2) and (B,), as of `Gaussians`.
    """
    mean, spread, turn = raw[..., :2], raw[..., 2:4], raw[..., 4]
    sigma = functional.softplus(spread) * unit_m + FLOOR_M
    return mean * unit_m + middle_m, sigma, _MOST_CORRELATED * turn.tanh()


def negative_log_likelihood(found: Gaussians, positions: Tensor) -> Tensor:
    """−log of the densities at some positions, in closed form (Bishop, Pattern Recognition, 2.43).

    Args:
        found: (B, T) distributions.
        positions: (B, T, 2), metres.

    Returns:
        (B, T) float32 at least, in nats.
    """
    precise = torch.promote_types(found.mean.dtype, torch.float32)
    mean, sigma, rho = (value.to(precise) for value in found)
    x, y = ((positions.to(precise) - mean) / sigma).unbind(-1)
    # As two squares, no difference of large numbers: y given x is a Gaussian of its own.
    unexplained = (1 - rho) * (1 + rho)
    squares = x.square() + (y - rho * x).square() / unexplained
    return math.log(2 * math.pi) + sigma.log().sum(-1) + (unexplained.log() + squares) / 2
