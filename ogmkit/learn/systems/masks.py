"""What systems that predict two masks share: how the masks are scored and shown."""

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import replace

import torch
from torch import Tensor

from ogmkit.grid import GridSpec
from ogmkit.learn.models.losses import CellLoss
from ogmkit.learn.perception_settings import BalancedTraining
from ogmkit.learn.systems.base import Answer, Batch, System
from ogmkit.learn.systems.iou_curve import BINS, IouCurve
from ogmkit.learn.systems.shown import Shown, shown_masks
from ogmkit.samples.spec import TARGETS, SampleSpec


class MaskSystem(System):
    """A system whose prediction is two masks, scored by their IoU (of the positive class).

    Scored is what the system is trained on: masks in camera view, or cells of its own grid. The score is the
    IoU at a probability of 0.5; the thresholds with the best IoU in the last validation are kept as well.

    Attributes:
        thresholds: (2,) of drivable and vehicles; they travel in checkpoints.
    """

    score_name = "iou"
    settings: BalancedTraining
    thresholds: Tensor

    def __init__(self, settings: BalancedTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.cell_loss = CellLoss(settings.balance, len(TARGETS))
        self.iou = IouCurve(len(TARGETS))
        self.register_buffer("thresholds", torch.full((len(TARGETS),), 0.5))

    @abstractmethod
    def answer(self, batch: Batch) -> Answer:
        """`logits`, (B, 2, h, w), of the masks that it is trained on, and what else the loss needs."""

    @abstractmethod
    def truth(self, batch: Batch) -> tuple[Tensor, Tensor | None]:
        """(B, 2, h, w) masks 0/1, and (B, h, w) 0/1 where they are known; None where everywhere."""

    @property
    def prepare_spec(self) -> SampleSpec | None:
        """The masks, where their classes are weighted."""
        return replace(self.spec, image=False) if self.settings.balance == "weighted" else None

    def prepare(self, samples: Iterable[Batch]) -> None:
        """Weigh the classes."""
        self.cell_loss.fit(map(self.truth, samples))

    def update_score(self, answer: Answer, batch: Batch) -> None:
        """Count cells, but for unknown ones."""
        self.iou.update(answer["logits"].sigmoid(), *self.truth(batch))

    def scores(self) -> dict[str, Tensor]:
        """IoU of each target and their mean."""
        curve = self.iou.compute()
        self.iou.reset()
        self.thresholds.copy_(curve.argmax(1) / BINS)
        values = curve[:, BINS // 2].float()
        return {f"iou_{name}": value for name, value in zip(TARGETS, values, strict=True)} | {
            "iou": values.mean()
        }

    def pictures(self, batch: Batch) -> Shown:
        """Prediction, truth and their difference."""
        return shown_masks(self.answer(batch)["logits"].sigmoid(), *self.truth(batch))
