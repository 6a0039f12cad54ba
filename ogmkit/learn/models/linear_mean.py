"""The linear plan as a part of a network: what a planner's means may be learnt on top of."""

import numpy as np
import torch
from torch import Tensor, nn

from ogmkit.learn.models.standard import Standard
from ogmkit.metrics.linear import fit_linear_plan
from ogmkit.metrics.plan import STEPS
from ogmkit.samples.index import SEQUENCE

_FEATURES = 2 * (SEQUENCE + 1)
"""x and y of the positions and of the destination."""


class LinearMean(nn.Module):
    """A `LinearPlan` in fixed numbers that travel with the weights, and what it leaves over.

    Attributes:
        centre: (14,), as of `ogmkit.metrics.linear.LinearPlan`.
        weights: (14, 10), likewise.
        middle: (10,), likewise.
        of_residuals: means and spreads of truths less linear plans.
    """

    centre: Tensor
    weights: Tensor
    middle: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("centre", torch.zeros(_FEATURES))
        self.register_buffer("weights", torch.zeros(_FEATURES, 2 * STEPS))
        self.register_buffer("middle", torch.zeros(2 * STEPS))
        self.of_residuals = Standard()

    def fit(self, positions: Tensor, destination: Tensor, points: Tensor) -> None:
        """Take the least-squares plan of (N, 6, 2) positions, (N, 2) destinations and (N, 5, 2) points."""
        arrays = [np.asarray(values.double().cpu().numpy()) for values in (positions, destination, points)]
        plan = fit_linear_plan(*arrays)
        for name in ("centre", "weights", "middle"):
            getattr(self, name).copy_(torch.from_numpy(getattr(plan, name)))
        self.of_residuals.fit(points - self(positions, destination))

    def forward(self, positions: Tensor, destination: Tensor) -> Tensor:
        """(B, 6, 2) and (B, 2) → (B, 5, 2) positions, all in metres."""
        about_centre = torch.cat([positions.flatten(1), destination], dim=1) - self.centre
        # No matrix product, whose factors --precision bf16-mixed would round to two digits.
        points = (about_centre[:, :, None] * self.weights).sum(1) + self.middle
        return points.reshape(-1, STEPS, 2)
