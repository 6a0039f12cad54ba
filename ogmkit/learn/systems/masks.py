"""What systems that predict two masks share: how the masks are scored and shown."""

from abc import abstractmethod

import torch
from torch import Tensor
from torchmetrics.classification import MultilabelJaccardIndex

from ogmkit.grid import GridSpec
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import Answer, Batch, System, mask_panels
from ogmkit.samples.spec import TARGETS

_UNKNOWN = -1


class MaskSystem(System):
    """A system whose prediction is two masks, scored by their IoU (of the positive class).

    The score is on what the system is trained on: masks in camera view, or cells of its own grid.
    """

    score_name = "iou"

    def __init__(self, settings: TrainSettings, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.iou = MultilabelJaccardIndex(len(TARGETS), average=None, ignore_index=_UNKNOWN)

    @abstractmethod
    def answer(self, batch: Batch) -> Answer:
        """`logits`, (B, 2, h, w), of the masks that it is trained on, and what else the loss needs."""

    @abstractmethod
    def truth(self, batch: Batch) -> tuple[Tensor, Tensor | None]:
        """(B, 2, h, w) masks 0/1, and (B, h, w) 0/1 where they are known; None where everywhere."""

    def update_score(self, answer: Answer, batch: Batch) -> None:
        """Count cells, but for unknown ones."""
        target, known = self.truth(batch)
        labels = target.to(torch.int64)
        if known is not None:
            labels = torch.where(known[:, None] > 0, labels, _UNKNOWN)
        self.iou.update(answer["logits"].sigmoid(), labels)

    def scores(self) -> dict[str, Tensor]:
        """IoU of each target and their mean."""
        values = self.iou.compute()
        self.iou.reset()
        return {f"iou_{name}": value for name, value in zip(TARGETS, values, strict=True)} | {
            "iou": values.mean()
        }

    def pictures(self, batch: Batch) -> tuple[Tensor, ...]:
        """Prediction beside truth."""
        return mask_panels(self.answer(batch)["logits"].sigmoid()), mask_panels(self.truth(batch)[0])
