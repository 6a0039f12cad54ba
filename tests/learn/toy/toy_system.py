"""A system that is not in the catalogue: it learns a mean map, whatever the frame."""

from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import nn

from ogmkit.base.stated import setting
from ogmkit.learn.models.losses import perception_loss
from ogmkit.learn.perception_settings import BalancedTraining
from ogmkit.learn.systems.base import Prediction
from ogmkit.learn.systems.masks import MaskSystem
from ogmkit.samples.spec import TARGETS, SampleSpec


@dataclass(frozen=True, kw_only=True)
class ToyTraining(BalancedTraining):
    """Of `toy`."""

    system: ClassVar[str] = "toy"
    start: float = setting(0.0, "Logit that every cell begins with.", "Model", low=-10, high=10)


class ToySystem(MaskSystem):
    """A logit for each cell."""

    settings: ToyTraining

    def __init__(self, settings, grid, cameras):
        super().__init__(settings, grid, cameras)
        self.logits = nn.Parameter(torch.full((len(TARGETS), *grid.shape), settings.start))

    @property
    def spec(self):
        return SampleSpec(bev_cell_m=self.grid.m_per_cell, bev=True)

    def prediction_spec(self, homography):
        return SampleSpec()

    def answer(self, batch):
        return {"logits": self.logits.expand(len(batch["index"]), -1, -1, -1)}

    def truth(self, batch):
        return batch["bev"], batch["bev_known"]

    def losses(self, answer, batch):
        losses = self.cell_loss(answer["logits"], batch["bev"])
        return {"perception": perception_loss(losses, batch["bev_known"])}

    def predict(self, batch):
        return Prediction(self.answer(batch)["logits"].sigmoid())
