"""The linear plan as a part of a network: what a planner's means may be learnt on top of."""

import numpy as np
import torch
from torch import Tensor, nn

from ogmkit.learn.models.standard import Standard
from ogmkit.metrics.linear import fit_linear_plan
from ogmkit.metrics.plan import STEPS
from ogmkit.samples.index import SEQUENCE
from ogmkit.typing import FloatArray


class LinearMean(nn.Module):
    """A `LinearPlan` in fixed numbers that travel with the weights, and what it leaves over.

    Args:
        points: T, that it plans.
        told: whether it is of the destination, too.

    Attributes:
        centre: (F,), as of `ogmkit.metrics.linear.LinearPlan`: F is 14, or 12 without destination.
        weights: (F, 2 T), likewise.
        middle: (2 T,), likewise.
        of_residuals: means and spreads of truths less linear plans.
    """

    centre: Tensor
    weights: Tensor
    middle: Tensor

    def __init__(self, points: int = STEPS, *, told: bool = True) -> None:
        super().__init__()
        features = 2 * (SEQUENCE + told)
        self.register_buffer("centre", torch.zeros(features))
        self.register_buffer("weights", torch.zeros(features, 2 * points))
        self.register_buffer("middle", torch.zeros(2 * points))
        self.of_residuals = Standard()

    def fit(self, positions: Tensor, destination: Tensor | None, points: Tensor) -> None:
        """Take the least-squares plan of (N, 6, 2) positions, (N, 2) destinations and (N, T, 2) points."""
        plan = fit_linear_plan(
            _array(positions), None if destination is None else _array(destination), _array(points)
        )
        for name in ("centre", "weights", "middle"):
            getattr(self, name).copy_(torch.from_numpy(getattr(plan, name)))
        self.of_residuals.fit(points - self(positions, destination))

    def forward(self, positions: Tensor, destination: Tensor | None) -> Tensor:
        """(B, 6, 2) and (B, 2) → (B, T, 2) positions, all in metres."""
        told = () if destination is None else (destination,)
        about_centre = torch.cat([positions.flatten(1), *told], dim=1) - self.centre
        # No matrix product, whose factors --precision bf16-mixed would round to two digits.
        points = (about_centre[:, :, None] * self.weights).sum(1) + self.middle
        return points.reshape(len(points), -1, 2)


def _array(values: Tensor) -> FloatArray:
    return np.asarray(values.double().cpu().numpy())
