"""The network that predicts a homography from an image (paper, Homography estimation)."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import torch
from torch import Tensor
from torch.nn import functional
from torchmetrics import MeanMetric

from ogmkit.errors import TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.models.four_point_code import FourPointCode
from ogmkit.learn.models.homography_code import EntriesCode, HomographyCode
from ogmkit.learn.models.homography_net import HomographyNet
from ogmkit.learn.models.warp import warp_to_bev
from ogmkit.learn.perception_settings import HomographyTraining
from ogmkit.learn.systems.base import Answer, Batch, Prediction, System
from ogmkit.learn.systems.shown import Shown, rgb
from ogmkit.samples.spec import SampleSpec

_CODES: Mapping[str, type[HomographyCode]] = {"entries": EntriesCode, "four-point": FourPointCode}
_RANGE_M = (5.0, 40.0)
"""Ground whose place is scored, by its distance from the ego."""
_FARTHEST_M = 20.0
"""An error counts no more than this: a place thrown to the horizon must not outweigh all others."""


class HomographySystem(System):
    """ResNet and four fully connected layers; L2 on what the head gives, standardised by fixed factors.

    Scored by the mean BEV error in metres of ground within 40 m, against the source that it learns.
    """

    score_name = "error_m"
    score_sign = -1
    has_bev = False
    prepare_rounds = 8  # of angles, which are random
    settings: HomographyTraining

    def __init__(self, settings: HomographyTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.code = _CODES[settings.head](len(cameras), settings.image_size, grid)
        self.net = HomographyNet(settings.encoder, settings.encoder_weights, self.code.size)
        self.error_m = MeanMetric()

    @property
    def spec(self) -> SampleSpec:
        """Images and the source's homographies."""
        return SampleSpec(self.settings.image_size, homography=self.settings.target)

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images."""
        del homography
        return SampleSpec(self.settings.image_size)

    @property
    def prepare_spec(self) -> SampleSpec:
        """Homographies of images of this size, which needn't be read."""
        return replace(self.spec, image=False)

    def prepare(self, samples: Iterable[Batch]) -> None:
        """Fix the factors of the head from the training frames."""
        batches = [(batch["bev_from_image"], batch["mirrored"], batch["camera"]) for batch in samples]
        homographies, mirrored, cameras = (torch.cat(parts) for parts in zip(*batches, strict=True))
        for place, camera in enumerate(self.cameras):
            if not bool((cameras == place).any()):
                raise TrainingError(f"no training frame of {camera}; leave it out, or fit homographies to it")
        fitted = type(self.code).fit(
            homographies, cameras, len(self.cameras), self.settings.image_size, self.grid, mirrored
        )
        self.code.load_state_dict(fitted.state_dict())

    def answer(self, batch: Batch) -> Answer:
        """The code of each homography."""
        return {"code": self.net(batch["image"])}

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """L2 between codes."""
        target = self.code.encode(batch["bev_from_image"], batch["camera"], batch["mirrored"])
        return {"homography": functional.mse_loss(answer["code"], target)}

    def predict(self, batch: Batch) -> Prediction:
        """Homographies of the resized images' pixels; NaN where the network's answer is singular."""
        return Prediction(bev_from_image=self.code.decode(self.answer(batch)["code"], batch["camera"]))

    def update_score(self, answer: Answer, batch: Batch) -> None:
        """Send pixels to the ground by truth and by prediction."""
        predicted = self.code.decode(answer["code"], batch["camera"])
        self.error_m.update(self._errors_m(predicted, batch["bev_from_image"]))

    def scores(self) -> dict[str, Tensor]:
        """Mean error in metres."""
        value = self.error_m.compute()
        self.error_m.reset()
        return {"error_m": value}

    def pictures(self, batch: Batch) -> Shown:
        """The image on the plane by prediction and by truth."""
        found = self.code.decode(self.answer(batch)["code"], batch["camera"])
        true = batch["bev_from_image"]
        planes = {"laid on the plane": found, "by the truth": true}
        panels = [
            (title, rgb(warp_to_bev(batch["image"], matrix, self.grid.shape)))
            for title, matrix in planes.items()
        ]
        errors_m = [
            float(self._errors_m(*pair).mean()) for pair in zip(found[:, None], true[:, None], strict=True)
        ]
        scores = tuple(f"error {error:.2f} m" for error in errors_m)
        return Shown((("image", rgb(batch["image"])), *panels), scores)

    def _errors_m(self, predicted: Tensor, truth: Tensor) -> Tensor:
        """Distances on the plane between where two homographies put pixels that see the ground near by."""
        height, width = self.settings.image_size
        v, u = torch.meshgrid(
            torch.linspace(0.5, 1, 12, dtype=truth.dtype, device=truth.device) * (height - 1),
            torch.linspace(0, 1, 9, dtype=truth.dtype, device=truth.device) * (width - 1),
            indexing="ij",
        )
        pixels = torch.stack([u, v, torch.ones_like(u)]).reshape(3, -1)
        there = _cells(truth, pixels)
        here = _cells(predicted, pixels)
        ego = torch.tensor([self.grid.ego_column - 0.5, self.grid.ego_row - 0.5], device=truth.device)
        range_m = (there - ego[:, None]).norm(dim=1) * self.grid.m_per_cell
        seen = (range_m > _RANGE_M[0]) & (range_m < _RANGE_M[1])
        error_m = (here - there).norm(dim=1) * self.grid.m_per_cell
        result: Tensor = error_m[seen].nan_to_num(_FARTHEST_M).clamp(max=_FARTHEST_M)
        return result


def _cells(homography: Tensor, pixels: Tensor) -> Tensor:
    """(B, 2, K) cells of (3, K) homogeneous pixels; NaN at and above the horizon."""
    mapped = homography @ pixels
    w = mapped[:, 2:]
    return torch.where(w > 0, mapped[:, :2] / w, torch.nan)
