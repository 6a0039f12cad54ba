"""What all systems share: a Lightning module that knows its settings, its samples and its score."""

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import torch
from lightning.pytorch import LightningModule
from lightning.pytorch.utilities.types import OptimizerLRSchedulerConfig
from torch import Tensor
from torch.nn import Module
from torch.nn.modules.batchnorm import _BatchNorm

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.tensors import as_float
from ogmkit.learn.models.gaussian import Gaussians
from ogmkit.learn.perception_settings import EncoderTraining
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.optimisation import optimisation
from ogmkit.learn.systems.shown import Shown
from ogmkit.samples.spec import SampleSpec

Batch = dict[str, Tensor]
Answer = dict[str, Tensor]

_PART_DEPTH = 2
"""Parts that messages list are no deeper than that."""
_STEP_STRIDE = 1_000_003
"""Spreads (seed, epoch, batch) over the generator's seeds; a prime, so that few of them meet."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """What a system says of a batch of B frames.

    Attributes:
        bev: (B, 2, rows, columns) probabilities on the shards' grid; None for a system without.
        image: (B, 2, h, w) probabilities at the network's image size; None for a system without.
        bev_from_image: (B, 3, 3) float64 from pixels of the resized image; None for a system without.
        plan: distributions of future points 1 … 5; None for a system without.
    """

    bev: Tensor | None = None
    image: Tensor | None = None
    bev_from_image: Tensor | None = None
    plan: Gaussians | None = None


class System(LightningModule):
    """A network with what it is fed, its loss, and what it predicts.

    Args:
        settings: of the training.
        grid: of the shards.
        cameras: channels, in the order that samples number them.

    Attributes:
        settings: see above.
        grid: see above.
        cameras: see above.
        score_name: of the validation figure that the best checkpoint is chosen by.
        score_sign: 1 where more of it is better, −1 where less is.
        has_bev: whether it predicts BEV masks.
        plans: whether it plans: its samples are sequences then.
        prepare_rounds: how often `prepare` sees each training sample, where augmentation moves it.
        loaded: names of the tensors that another run has filled, where the training starts from one.
    """

    score_name: ClassVar[str]
    score_sign: ClassVar[int] = 1
    has_bev: ClassVar[bool] = True
    plans: ClassVar[bool] = False
    prepare_rounds: ClassVar[int] = 1

    def __init__(self, settings: TrainSettings, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__()
        self.settings = settings
        self.grid = grid
        self.cameras = cameras
        self.loaded: frozenset[str] = frozenset()
        self._frozen: list[Module] = []

    @property
    @abstractmethod
    def spec(self) -> SampleSpec:
        """What it is trained on."""

    @abstractmethod
    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """What it predicts from; `homography` is the source that warps, for a system that needs one."""

    @property
    def image_spec(self) -> SampleSpec:
        """What `look` needs of single frames; no label."""
        return self.prediction_spec(None)

    def look(self, batch: Batch) -> None:
        """Run what sees images on single frames, for what it finds out about them on its way."""
        self.answer(batch)

    @abstractmethod
    def answer(self, batch: Batch) -> Answer:
        """What the network says of a batch, as loss and score take it."""

    @abstractmethod
    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """Name → scalar term; their sum is the loss."""

    @abstractmethod
    def predict(self, batch: Batch) -> Prediction:
        """Predict from a batch of `prediction_spec` samples."""

    @abstractmethod
    def update_score(self, answer: Answer, batch: Batch) -> None:
        """Take a validation batch into the metrics."""

    @abstractmethod
    def scores(self) -> dict[str, Tensor]:
        """Name → figure over all validation batches since the last call; resets the metrics."""

    @abstractmethod
    def pictures(self, batch: Batch) -> Shown:
        """Predictions beside the truth, with their scores."""

    @property
    def prepare_spec(self) -> SampleSpec | None:
        """What `prepare` reads; None for a system that learns no statistics."""
        return None

    def prepare(self, samples: Iterable[Batch]) -> None:
        """Learn fixed statistics from training samples, augmented as in training, before the first step."""

    def freeze_parts(self) -> None:
        """Take what the settings freeze out of the training.

        Raises:
            SettingsError: a part is unknown.
        """
        named = {name: module for name, module in self.named_modules() if name}
        for part in self.settings.freeze:
            found = [module for name, module in named.items() if part in (name, name.rpartition(".")[2])]
            if not found:
                known = sorted({name.rpartition(".")[2] for name in named if name.count(".") < _PART_DEPTH})
                raise SettingsError(f"freeze: {unknown('part', part, known)}")
            self._frozen += [module.requires_grad_(requires_grad=False) for module in found]
        if self.settings.batch_norm == "kept":
            self._frozen += [module for module in named.values() if isinstance(module, _BatchNorm)]
        self.train(self.training)

    def train(self, mode: bool = True) -> Self:
        """As of any module; but what is frozen keeps its statistics."""
        super().train(mode)
        for module in self._frozen:
            module.eval()
        return self

    def on_after_batch_transfer(self, batch: Batch, dataloader_idx: int) -> Batch:
        """Floats are made of bytes on the device."""
        del dataloader_idx
        return as_float(batch)

    def training_step(self, batch: Batch, batch_idx: int) -> Tensor:
        """One step; whatever is random in it follows from seed, epoch and batch, however often resumed.

        What is logged is the mean over all devices.
        """
        number = batch_idx * self.trainer.world_size + self.trainer.global_rank
        place = (self.settings.seed * _STEP_STRIDE + self.current_epoch) * _STEP_STRIDE + number
        torch.manual_seed(place % 2**63)
        terms = self.losses(self.answer(batch), batch)
        loss = torch.stack(list(terms.values())).sum()
        own = torch.stack([*terms.values(), loss]).detach()
        shared = self.trainer.strategy.reduce(own.clone(), reduce_op="mean")
        self._require_finite(shared[-1], terms, batch, self.trainer.datamodule.train_set)  # type: ignore[attr-defined]
        names = [f"train/{name}" for name in (*terms, "loss")]
        self.log_dict(dict(zip(names, shared, strict=True)), on_step=True, on_epoch=False)
        return loss

    def validation_step(self, batch: Batch, batch_idx: int) -> None:
        """Score one batch, and its loss beside; one that another device has, too, counts there alone."""
        answer = self.answer(batch)
        terms = self.losses(answer, batch)
        values = {f"val/{name}": value for name, value in terms.items()}
        data = self.trainer.datamodule  # type: ignore[attr-defined]  # a ShardDataModule
        values["val/loss"] = torch.stack(list(terms.values())).sum()
        self._require_finite(values["val/loss"], terms, batch, data.val_set)
        counted = 0 if data.val_batches.repeats(batch_idx) else len(batch["index"])
        # All devices log, whatever counts: they wait for each other. Lightning divides the sum of their
        # counts by how many they are, in whole numbers.
        weight = counted * self.trainer.world_size
        self.log_dict(values, on_step=False, on_epoch=True, batch_size=weight, sync_dist=True)
        if counted:
            self.update_score(answer, batch)

    def on_validation_epoch_end(self) -> None:
        """Log the scores."""
        self.log_dict({f"val/{name}": value for name, value in self.scores().items()})

    def configure_optimizers(self) -> torch.optim.Optimizer | OptimizerLRSchedulerConfig:
        """As the settings say."""
        settings = self.settings
        encoder_lr = settings.encoder_lr if isinstance(settings, EncoderTraining) else 1.0
        return optimisation(self, settings, encoder_lr, lambda: self.trainer.estimated_stepping_batches)

    def _require_finite(
        self, loss: Tensor, terms: Mapping[str, Tensor], batch: Batch, samples: FrameDataset
    ) -> None:
        if bool(torch.isfinite(loss.detach())):
            return
        step = self.trainer.global_step + 1
        if all(bool(torch.isfinite(value.detach())) for value in terms.values()):
            raise TrainingError(
                f"the loss is not finite at step {step} on another device, which names its batch"
            )
        shown = ", ".join(f"{name} {float(value.detach()):g}" for name, value in terms.items())
        names = "; ".join(samples.name(int(index)) for index in batch["index"])
        raise TrainingError(
            f"the loss is not finite at step {step} ({shown}), batch of {names}; "
            "lower --lr, or look at these frames; checkpoints of the steps before are kept"
        )

    def camera_indices(self, batch: Batch, cameras: tuple[str, ...]) -> Tensor:
        """(B,) places among this system's cameras of a batch whose samples number others.

        Raises:
            SettingsError: the system was not trained on one of them.
        """
        for camera in cameras:
            if camera not in self.cameras:
                raise SettingsError(
                    f"camera {camera} is unknown to this run, which was trained on {', '.join(self.cameras)}"
                )
        places = torch.tensor([self.cameras.index(camera) for camera in cameras])
        return places.to(batch["camera"].device)[batch["camera"]]
