"""Losses of the networks that predict masks: what a cell costs, and how cells are added up."""

from collections.abc import Iterable

import torch
from torch import Tensor, nn
from torch.nn import functional
from torchvision.ops import sigmoid_focal_loss

from ogmkit.learn.models.ved import kl_divergence
from ogmkit.learn.perception_settings import Balance

_FOCUS = 2.0
"""γ of the focal loss, as published."""


class CellLoss(nn.Module):
    """What each cell of two masks costs, by the balance that is set between the classes.

    - `none`: binary cross-entropy, as the paper has it.
    - `weighted`: the same, positive cells of a target weighing √(negatives / positives) of the training
      frames, so that rare vehicles are not drowned and common ground is not blown up.
    - `focal`: cells that are right already count less (Lin et al. 2017, γ = 2, without α).

    The weights are a buffer, and travel in checkpoints, where they are used.

    Args:
        balance: see above.
        targets: how many masks there are.
    """

    positive_weight: Tensor

    def __init__(self, balance: Balance, targets: int) -> None:
        super().__init__()
        self.balance = balance
        if balance == "weighted":
            self.register_buffer("positive_weight", torch.ones(targets))

    def fit(self, truths: Iterable[tuple[Tensor, Tensor | None]]) -> None:
        """Learn the weights from training masks; a target that is nowhere, or everywhere, weighs 1.

        Args:
            truths: (B, T, h, w) masks 0/1, and (B, h, w) 0/1 where they are known; None where everywhere.
        """
        counts = [_counts(*truth) for truth in truths]
        positives, negatives = torch.stack(counts).sum(0)
        known = (positives > 0) & (negatives > 0)
        self.positive_weight.copy_(torch.where(known, (negatives / positives.clamp(min=1)).sqrt(), 1.0))

    def forward(self, logits: Tensor, target: Tensor) -> Tensor:
        """(B, T, h, w) logits and masks 0/1 → (B, T, h, w) losses."""
        if self.balance == "focal":
            focal: Tensor = sigmoid_focal_loss(logits, target, alpha=-1, gamma=_FOCUS)
            return focal
        weight = self.positive_weight[:, None, None] if self.balance == "weighted" else None
        return functional.binary_cross_entropy_with_logits(
            logits, target, pos_weight=weight, reduction="none"
        )


def mean_of_known(losses: Tensor, known: Tensor | None = None) -> Tensor:
    """Mean over known cells and all targets.

    Args:
        losses: (B, T, h, w) of cells.
        known: (B, h, w) 0/1, whether the target is known; None where it is everywhere.

    Returns:
        Scalar; 0 where nothing is known.
    """
    if known is None:
        return losses.mean()
    return (losses * known[:, None]).sum() / (known.sum() * losses.shape[1]).clamp(min=1)


def perception_loss(losses: Tensor, known: Tensor | None = None) -> Tensor:
    """Sum of one mean a target, drivable and vehicles (paper, Footprint segmentation).

    Args and result as `mean_of_known`; all targets are known in the same cells.
    """
    return mean_of_known(losses, known) * losses.shape[1]


def summed_perception_loss(losses: Tensor, known: Tensor | None = None) -> Tensor:
    """Sum over known cells and targets, mean over frames.

    As the publication of OFT sums it (Roddick et al. 2019), to which its learning rate of 1e-7 belongs.
    Args and result as `mean_of_known`.
    """
    return (losses if known is None else losses * known[:, None]).sum() / len(losses)


def elbo(losses: Tensor, known: Tensor | None, mu: Tensor, logvar: Tensor, kl_weight: float) -> Tensor:
    """Negative evidence lower bound a cell: what a variational encoder–decoder minimises (Lu et al. 2019).

    Args:
        losses: (B, 1, rows, columns) of cells.
        known: (B, rows, columns) 0/1; None where the target is known everywhere.
        mu: (B, L) mean of the latent.
        logvar: (B, L) logarithm of its variance.
        kl_weight: of the divergence from the prior; 1 is the bound.

    Returns:
        Scalar: mean loss + kl_weight · KL / cells.
    """
    cells = losses[0].numel()
    return mean_of_known(losses, known) + kl_weight * kl_divergence(mu, logvar).mean() / cells


def _counts(masks: Tensor, known: Tensor | None) -> Tensor:
    """(2, T) float64 numbers of positive and of negative cells."""
    where = torch.ones_like(masks[:, 0]) if known is None else known
    positives = (masks * where[:, None]).double().sum((0, 2, 3))
    return torch.stack([positives, where.double().sum() - positives])
