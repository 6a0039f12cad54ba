"""Plans of many sequences, as columns."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.metrics.plan import STEPS, Plan
from ogmkit.typing import FloatArray


@dataclass(frozen=True, eq=False)
class Plans:
    """Plans of N sequences; each in the level frame of its own last image.

    Attributes:
        mean: (N, T, 2) float64, metres.
        sigma: (N, T, 2) float64, metres; NaN where there is no distribution.
        rho: (N, T) float64; NaN as `sigma`.
    """

    mean: FloatArray
    sigma: FloatArray
    rho: FloatArray

    @property
    def told(self) -> bool:
        """As of `Plan`."""
        return bool(self.mean.shape[1] == STEPS)

    @property
    def on_the_way(self) -> "Plans":
        """Of the points 1 … 5 alone, which all plans have."""
        return Plans(self.mean[:, :STEPS], self.sigma[:, :STEPS], self.rho[:, :STEPS])


def columns_of(plans: Sequence[Plan]) -> Plans:
    """Plans one after the other; at least one."""
    mean, sigma, rho = (
        np.stack([getattr(plan, name) for plan in plans]) for name in ("mean", "sigma", "rho")
    )
    return Plans(mean, sigma, rho)


def points_only(mean: FloatArray) -> Plans:
    """Plans without distributions, of (N, T, 2) positions."""
    return Plans(mean, np.full_like(mean, np.nan), np.full(mean.shape[:-1], np.nan))
