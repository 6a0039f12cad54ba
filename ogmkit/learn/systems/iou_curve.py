"""IoU of masks at every threshold, from counts that add up over batches and devices."""

import torch
from torch import Tensor
from torchmetrics import Metric

BINS = 100
"""Thresholds are multiples of a hundredth."""


class IouCurve(Metric):
    """Counts true and false cells by their probability.

    Args:
        targets: how many masks there are.
    """

    counts: Tensor

    def __init__(self, targets: int) -> None:
        super().__init__()
        self.targets = targets
        empty = torch.zeros(targets, 2, BINS, dtype=torch.int64)
        self.add_state("counts", empty, dist_reduce_fx="sum")

    def update(self, probabilities: Tensor, truth: Tensor, known: Tensor | None = None) -> None:
        """Count a batch.

        Args:
            probabilities: (B, T, h, w).
            truth: (B, T, h, w) 0/1.
            known: (B, h, w) 0/1; None where the truth is known everywhere.
        """
        # A probability exceeds k hundredths where its bin is k or more.
        bins = ((probabilities * BINS).ceil() - 1).clamp(0, BINS - 1).to(torch.int64)
        target = torch.arange(self.targets, device=bins.device)[:, None, None]
        places = (target * 2 + truth.to(torch.int64)) * BINS + bins
        chosen = places.flatten() if known is None else places[(known > 0)[:, None].expand_as(places)]
        found = torch.bincount(chosen, minlength=self.counts.numel())
        self.counts += found.reshape_as(self.counts)

    def compute(self) -> Tensor:
        """(T, BINS) float64 IoU of the positive class, at thresholds of k / BINS; 0 where there is none."""
        over = self.counts.flip(-1).cumsum(-1).flip(-1).double()  # cells at least as probable
        negative, positive = over[:, 0], over[:, 1]
        return positive / (positive[:, :1] + negative).clamp(min=1)
