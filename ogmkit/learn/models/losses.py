"""Losses of the networks that predict masks."""

from torch import Tensor
from torch.nn import functional

from ogmkit.learn.models.ved import kl_divergence


def binary_cross_entropy(logits: Tensor, target: Tensor, known: Tensor | None = None) -> Tensor:
    """Mean binary cross-entropy over known cells and all targets.

    Args:
        logits: (B, T, h, w).
        target: (B, T, h, w) 0/1.
        known: (B, h, w) 0/1, whether the target is known; None where it is everywhere.

    Returns:
        Scalar; 0 where nothing is known.
    """
    if known is None:
        return functional.binary_cross_entropy_with_logits(logits, target)
    cells = known.sum() * target.shape[1]
    return _sum_of_known(logits, target, known) / cells.clamp(min=1)


def perception_loss(logits: Tensor, target: Tensor, known: Tensor | None = None) -> Tensor:
    """Sum of one mean binary cross-entropy a target, drivable and vehicles (paper, Footprint segmentation).

    Args and result as `binary_cross_entropy`; all targets are known in the same cells.
    """
    return binary_cross_entropy(logits, target, known) * target.shape[1]


def summed_perception_loss(logits: Tensor, target: Tensor, known: Tensor | None = None) -> Tensor:
    """Binary cross-entropy summed over known cells and targets, mean over frames.

    As the publication of OFT sums it (Roddick et al. 2019), to which its learning rate of 1e-7 belongs.
    Args and result as `binary_cross_entropy`.
    """
    return _sum_of_known(logits, target, known) / len(target)


def elbo(
    logits: Tensor, target: Tensor, known: Tensor | None, mu: Tensor, logvar: Tensor, kl_weight: float
) -> Tensor:
    """Negative evidence lower bound a cell: what a variational encoder–decoder minimises (Lu et al. 2019).

    Args:
        logits: (B, 1, rows, columns).
        target: (B, 1, rows, columns) 0/1.
        known: (B, rows, columns) 0/1; None where the target is known everywhere.
        mu: (B, L) mean of the latent.
        logvar: (B, L) logarithm of its variance.
        kl_weight: of the divergence from the prior; 1 is the bound.

    Returns:
        Scalar: mean cross-entropy + kl_weight · KL / cells.
    """
    cells = target[0].numel()
    return binary_cross_entropy(logits, target, known) + kl_weight * kl_divergence(mu, logvar).mean() / cells


def _sum_of_known(logits: Tensor, target: Tensor, known: Tensor | None) -> Tensor:
    entropy = functional.binary_cross_entropy_with_logits(logits, target, reduction="none")
    return entropy.sum() if known is None else (entropy * known[:, None]).sum()
