"""What a system shows of a batch of validation frames while it is trained."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import torch
from torch import Tensor

from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import Plan, draw_paths, draw_plane
from ogmkit.drawing.cells import agreement_colours, overlap, target_colours
from ogmkit.drawing.palette import theme
from ogmkit.drawing.plan_marks import draw_plan_marks, plan_group
from ogmkit.grid import GridSpec
from ogmkit.samples.spec import TARGETS
from ogmkit.typing import FloatArray, UInt8Array

_AREA = Plan(GridSpec(0.5, rows=90, columns=60, ego_row=90, ego_column=30), px_per_m=10.0, behind_m=20.0)
"""Of plans: 45 m ahead, 20 m behind, 15 m to each side."""


@dataclass(frozen=True, eq=False)
class Shown:
    """Panels of B frames.

    Attributes:
        panels: title and (B, h, w, 3) uint8 RGB each, in reading order.
        scores: B texts that say how good the predictions are.
        groups: of the legend.
    """

    panels: tuple[tuple[str, UInt8Array], ...]
    scores: tuple[str, ...]
    groups: tuple[legend.Group, ...] = ()

    def after(self, title: str, picture: Tensor) -> Self:
        """The same with a (B, 3, h, w) picture, 0 … 1, before it."""
        return replace(self, panels=((title, rgb(picture)), *self.panels))


def rgb(picture: Tensor) -> UInt8Array:
    """(B, 3, h, w) colours, 0 … 1 → (B, h, w, 3) uint8."""
    scaled = (picture.detach().float().clamp(0, 1) * 255).round().to(torch.uint8)
    pixels: UInt8Array = np.ascontiguousarray(scaled.permute(0, 2, 3, 1).cpu().numpy())
    return pixels


def mask_colours(masks: Tensor) -> UInt8Array:
    """(B, 2, h, w) drivable and vehicles, 0 … 1 → (B, h, w, 3): as likely as they are, vehicles on top."""
    colours = theme()
    ground, road, vehicles = (
        torch.tensor(one, device=masks.device)[:, None, None] / 255
        for one in (colours.ground, colours.drivable, colours.vehicle)
    )
    below = masks[:, :1] * road + (1 - masks[:, :1]) * ground
    return rgb(below * (1 - masks[:, 1:]) + masks[:, 1:] * vehicles)


def shown_masks(predicted: Tensor, truth: Tensor, known: Tensor | None) -> Shown:
    """Prediction, truth, and where they differ at a probability of 0.5.

    Args:
        predicted: (B, 2, h, w) probabilities.
        truth: (B, 2, h, w) 0/1.
        known: (B, h, w) 0/1 where the truth is known; None for everywhere.
    """
    found, true = ((masks > 0.5).to(torch.uint8).cpu().numpy() for masks in (predicted, truth))
    seen = np.ones_like(true[:, 0]) if known is None else (known > 0).to(torch.uint8).cpu().numpy()
    difference = [
        agreement_colours((one[0], one[1]), (other[0], other[1]), where)
        for one, other, where in zip(true, found, seen, strict=True)
    ]
    panels = (
        ("predicted", mask_colours(predicted)),
        ("truth", mask_colours(truth)),
        ("difference", np.stack(difference)),
    )
    scores = tuple(_iou_text(*one) for one in zip(true, found, seen, strict=True))
    return Shown(panels, scores, (legend.IMAGE, legend.DRIVABLE, legend.VEHICLES))


def shown_plans(mean: Tensor, future: Tensor, positions: Tensor) -> Shown:
    """Past, truth, plan, and destination where it is told, from above.

    Args:
        mean: (B, T, 2) metres, level frame; T is 5, or 6 where the destination isn't told.
        future: (B, 6, 2).
        positions: (B, 6, 2).
    """
    points = [one.detach().double().cpu().numpy() for one in (mean, future, positions)]
    drawn = np.stack([_draw_plan(*one) for one in zip(*points, strict=True)])
    errors_m = np.linalg.norm(points[0] - points[1][:, : points[0].shape[1]], axis=-1).mean(axis=1)
    scores = tuple(f"ADE {error:.2f} m" for error in errors_m.tolist())
    group = plan_group(told=mean.shape[1] < future.shape[1], ellipses=False)
    return Shown((("from above", drawn),), scores, (legend.EGO, group))


def _draw_plan(mean: FloatArray, future: FloatArray, positions: FloatArray) -> UInt8Array:
    nothing = np.zeros(_AREA.grid.shape, np.uint8)
    canvas = draw_plane(target_colours(nothing, nothing, nothing + 1), _AREA)
    draw_paths(canvas, positions, future, _AREA)
    numbers = [str(step) for step in range(1, len(mean) + 1)]
    draw_plan_marks(canvas, _AREA, mean, future, labels=numbers)
    return canvas.pixels


def _iou_text(true: UInt8Array, found: UInt8Array, seen: UInt8Array) -> str:
    """IoU of each target of (2, h, w) masks."""
    shares = {name: overlap(true[i], found[i], seen) for i, name in enumerate(TARGETS)}
    return "IoU " + ", ".join(
        f"{name} none" if math.isnan(share) else f"{name} {share:.2f}" for name, share in shares.items()
    )
