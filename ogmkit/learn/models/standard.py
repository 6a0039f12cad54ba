"""Standardised coordinates."""

import torch
from torch import Tensor, nn

_LEAST_SPREAD = 1e-3
"""What hardly varies is not blown up."""


class Standard(nn.Module):
    """Fixed means and spreads of two coordinates, by which a network sees numbers of about ±1.

    Attributes:
        mean: (2,).
        spread: (2,), standard deviations.
    """

    mean: Tensor
    spread: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(2))
        self.register_buffer("spread", torch.ones(2))

    def fit(self, values: Tensor) -> None:
        """Take the statistics of (..., 2) values, in float64."""
        flat = values.reshape(-1, 2).double()
        self.mean.copy_(flat.mean(0))
        self.spread.copy_(flat.std(0, correction=0).clamp(min=_LEAST_SPREAD))

    def forward(self, values: Tensor) -> Tensor:
        """(..., 2) standardised."""
        return (values - self.mean) / self.spread
