"""Trajectories as pictures for the log of a training."""

import torch
from torch import Tensor

from ogmkit.metrics.plan import STEPS

_AHEAD_M, _BEHIND_M, _ASIDE_M = 45.0, 20.0, 15.0
_PX_PER_M = 4
_RADIUS_M = 0.5
_GROUND = 0.08
_PAST, _TRUTH, _DESTINATION, _PLAN = (0.6, 0.6, 0.6), (0.0, 0.62, 0.45), (0.94, 0.89, 0.26), (0.9, 0.62, 0.0)


def trajectory_panels(mean: Tensor, future: Tensor, positions: Tensor) -> Tensor:
    """Dots seen from above, x up: grey past, green truth, yellow destination, orange plan on top.

    Args:
        mean: (B, T, 2) metres, level frame.
        future: (B, 6, 2).
        positions: (B, 6, 2).

    Returns:
        (B, 3, h, w) colours, 0 … 1, of 20 m behind the ego to 45 m ahead, and 15 m to each side.
    """
    rows, columns = round((_AHEAD_M + _BEHIND_M) * _PX_PER_M), round(2 * _ASIDE_M * _PX_PER_M)
    x = _AHEAD_M - (torch.arange(rows, device=mean.device) + 0.5) / _PX_PER_M
    y = _ASIDE_M - (torch.arange(columns, device=mean.device) + 0.5) / _PX_PER_M
    panels = torch.full((len(mean), 3, rows, columns), _GROUND, device=mean.device)
    layers = (
        (positions, _PAST),
        (future[:, :STEPS], _TRUTH),
        (future[:, STEPS:], _DESTINATION),
        (mean, _PLAN),
    )
    for points, colour in layers:
        away = (x[:, None] - points[..., :1, None]).square() + (y - points[..., 1:, None]).square()
        dots = (away <= _RADIUS_M**2).any(1)[:, None]
        panels = torch.where(dots, panels.new_tensor(colour)[:, None, None], panels)
    return panels
