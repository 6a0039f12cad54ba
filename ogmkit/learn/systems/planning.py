"""Systems that plan from the past alone, from images, or from true masks (paper, Trajectory planning)."""

from abc import abstractmethod
from collections.abc import Iterable
from typing import ClassVar

import torch
from torch import Tensor
from torch.nn import functional
from torchmetrics import MeanMetric

from ogmkit.grid import GridSpec
from ogmkit.learn.models.encoders import MULTIPLE_PX, ImageEncoder, padded_size
from ogmkit.learn.models.gaussian import Gaussians, negative_log_likelihood
from ogmkit.learn.models.planner import Planner
from ogmkit.learn.models.recompute import recompute_blocks
from ogmkit.learn.planner_settings import EndToEndTraining, MidToEndTraining, PlannerTraining
from ogmkit.learn.systems.base import Answer, Batch, Prediction, System
from ogmkit.learn.systems.shown import Shown, shown_plans
from ogmkit.metrics.plan import STEPS
from ogmkit.samples.index import SEQUENCE
from ogmkit.samples.pooling import equal_parts, pooled_shape
from ogmkit.samples.spec import TARGETS, SampleSpec


class PlannerSystem(System):
    """A system that plans five positions on from six images, given the destination; without it, all six.

    Scored by the displacement in metres, mean over all points: the paper's ADE.
    """

    score_name = "ade"
    score_sign = -1
    has_bev = False
    plans: ClassVar[bool] = True
    settings: PlannerTraining

    def __init__(self, settings: PlannerTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.planner = Planner(
            self.feature_size(),
            past=settings.sees_past,
            hidden=settings.hidden,
            linear_mean=settings.mean == "linear",
            told=not settings.no_destination,
        )
        self.ade = MeanMetric()
        self.last = MeanMetric()

    @abstractmethod
    def feature_size(self) -> int:
        """Numbers a time step."""

    @abstractmethod
    def observed(self, batch: Batch) -> Answer:
        """`features`, (B, 6, F), if there are any, and what else the loss needs."""

    @property
    def spec(self) -> SampleSpec:
        """What it predicts from; the trajectory comes with every sequence."""
        return self.prediction_spec(None)

    @property
    def prepare_spec(self) -> SampleSpec | None:
        """Trajectories, unless the statistics came with the weights."""
        return None if self._is_prepared else SampleSpec(trajectory=True)

    def prepare(self, samples: Iterable[Batch]) -> None:
        """Learn the coordinates' means and spreads, and the linear mean where the settings ask for it."""
        if self._is_prepared:
            return
        batches = [(batch["positions"], batch["future"]) for batch in samples]
        positions, future = (torch.cat(parts) for parts in zip(*batches, strict=True))
        self.planner.fit(positions, future)

    @property
    def _is_prepared(self) -> bool:
        """Weights mean metres by the statistics that they were learnt with."""
        return self.loaded.issuperset(f"planner.{name}" for name, _ in self.planner.named_buffers())

    def answer(self, batch: Batch) -> Answer:
        """`mean`, `sigma` and `rho` of the plan, beside what `observed` gives.

        The planner has at least 32 bits where all else has 16: three digits of a position are decimetres.
        """
        seen = self.observed(batch)
        destination = None if self.settings.no_destination else batch["future"][:, STEPS]
        features = seen.get("features")
        with torch.autocast(batch["positions"].device.type, enabled=False):
            if features is not None:
                features = features.to(torch.promote_types(features.dtype, torch.float32))
            plan: Gaussians = self.planner(features, batch["positions"], destination)
        return {**seen, "mean": plan.mean, "sigma": plan.sigma, "rho": plan.rho}

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """Negative log-likelihood, summed over the points, mean over the sequences."""
        found = negative_log_likelihood(_plan(answer), self._targets(batch))
        return {"motion": found.sum(1).mean()}

    def predict(self, batch: Batch) -> Prediction:
        """The plan."""
        return Prediction(plan=_plan(self.answer(batch)))

    def update_score(self, answer: Answer, batch: Batch) -> None:
        """Displacements of all points, and of the last."""
        error_m = torch.linalg.vector_norm(answer["mean"] - self._targets(batch), dim=-1)
        self.ade.update(error_m)
        self.last.update(error_m[:, -1])

    def scores(self) -> dict[str, Tensor]:
        """Mean displacement over all points, and at the last."""
        values = {"ade": self.ade.compute(), "last_m": self.last.compute()}
        self.ade.reset()
        self.last.reset()
        return values

    def pictures(self, batch: Batch) -> Shown:
        """Where the ego was, is to go, and went."""
        answer = self.answer(batch)
        return shown_plans(answer["mean"], batch["future"], batch["positions"])

    def _targets(self, batch: Batch) -> Tensor:
        """(B, T, 2) positions that are to be planned."""
        return batch["future"][:, : self.planner.points]


class TrajectorySystem(PlannerSystem):
    """LSTM E-D: the past trajectory alone."""

    def feature_size(self) -> int:
        """None."""
        return 0

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Trajectories."""
        del homography
        return SampleSpec(trajectory=True)

    def observed(self, batch: Batch) -> Answer:
        """Nothing."""
        del batch
        return {}


class EndToEndSystem(PlannerSystem):
    """End-to-end: the flattened features of an image encoder."""

    settings: EndToEndTraining

    def __init__(self, settings: EndToEndTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        self._places = _feature_places(settings.image_size)
        encoder = ImageEncoder(settings.encoder, settings.encoder_weights)
        self._channels = encoder.out_channels[-1]
        super().__init__(settings, grid, cameras)
        self.encoder = encoder
        if settings.checkpoint_gradients:
            recompute_blocks(encoder)

    def feature_size(self) -> int:
        """Of the last feature map."""
        return self._channels * self._places

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images and trajectories."""
        del homography
        return SampleSpec(self.settings.image_size, trajectory=True)

    @property
    def image_spec(self) -> SampleSpec:
        """Images."""
        return SampleSpec(self.settings.image_size)

    def look(self, batch: Batch) -> None:
        """The encoder's look."""
        self.encoder(batch["image"])

    def observed(self, batch: Batch) -> Answer:
        """All six images' features."""
        features: Tensor = self.encoder(batch["image"].flatten(0, 1))[-1]
        return {"features": features.reshape(-1, SEQUENCE, features[0].numel())}

    def pictures(self, batch: Batch) -> Shown:
        """The last image before the trajectories."""
        return super().pictures(batch).after("last image", batch["image"][:, -1])


class MidToEndSystem(PlannerSystem):
    """Mid-to-end: the true masks from above, pooled and flattened."""

    settings: MidToEndTraining

    def feature_size(self) -> int:
        """Of both masks, pooled."""
        return pooled_size(self.grid.shape, self.settings.pool_cells)

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """The true masks and trajectories; where parts are equal, masks are pooled as they are read."""
        del homography
        parts = pooled_shape(self.grid.shape, self.settings.pool_cells)
        if equal_parts(self.grid, parts):
            return SampleSpec(trajectory=True, bev_parts=parts)
        return SampleSpec(bev_cell_m=self.grid.m_per_cell, bev=True, trajectory=True)

    def observed(self, batch: Batch) -> Answer:
        """Masks at all six images."""
        if "bev_parts" in batch:
            return {"features": batch["bev_parts"].flatten(2)}
        features = pooled(batch["bev"].flatten(0, 1), self.settings.pool_cells)
        return {"features": features.reshape(-1, SEQUENCE, self.feature_size())}


def pooled_size(shape: tuple[int, int], cells: int) -> int:
    """Numbers that two masks of (rows, columns) are pooled to."""
    rows, columns = pooled_shape(shape, cells)
    return len(TARGETS) * rows * columns


def pooled(masks: Tensor, cells: int) -> Tensor:
    """(B, 2, rows, columns) masks averaged over so many parts of their map at most: (B, F)."""
    rows, columns = masks.shape[-2:]
    return functional.adaptive_avg_pool2d(masks, pooled_shape((rows, columns), cells)).flatten(1)


def _feature_places(image_size: tuple[int, int]) -> int:
    height, width = padded_size(image_size)
    return (height // MULTIPLE_PX) * (width // MULTIPLE_PX)


def _plan(answer: Answer) -> Gaussians:
    return Gaussians(answer["mean"], answer["sigma"], answer["rho"])
