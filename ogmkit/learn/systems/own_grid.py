"""Systems that predict straight in BEV, on a grid of their own: VED, OFT and BEV-LiDAR."""

import torch
from torch import Tensor, nn

from ogmkit.grid import GridSpec
from ogmkit.learn.models.footprint_net import FootprintNet
from ogmkit.learn.models.losses import elbo, perception_loss, summed_perception_loss
from ogmkit.learn.models.oft import OftNet
from ogmkit.learn.models.ved import VedNet
from ogmkit.learn.perception_settings import (
    BevLidarTraining,
    OftTraining,
    OwnGridTraining,
    VedTraining,
)
from ogmkit.learn.systems.base import Answer, Batch, Prediction
from ogmkit.learn.systems.masks import MaskSystem
from ogmkit.learn.systems.shown import Shown
from ogmkit.samples.coarse import coarse_grid
from ogmkit.samples.spec import TARGETS, SampleSpec


class OwnGridSystem(MaskSystem):
    """A system on the shards' grid coarsened by a whole factor; predictions go back by repetition.

    Attributes:
        own_grid: the coarser grid.
        factor: its cell's side in cells of the shards' grid.
    """

    settings: OwnGridTraining

    def __init__(self, settings: OwnGridTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.cell_m = settings.bev_cell_m or grid.m_per_cell
        self.own_grid, self.factor = coarse_grid(grid, self.cell_m)

    @property
    def spec(self) -> SampleSpec:
        """What it predicts from, and the truth in BEV."""
        wanted = self.prediction_spec(None)
        return SampleSpec(
            wanted.image_size,
            bev_cell_m=self.cell_m,
            calibration=wanted.calibration,
            lidar=wanted.lidar,
            bev=True,
        )

    def truth(self, batch: Batch) -> tuple[Tensor, Tensor | None]:
        """Cells of the own grid."""
        return batch["bev"], batch["bev_known"]

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """Sum of two binary cross-entropies over known cells."""
        return {"perception": perception_loss(self._cell_losses(answer, batch), batch["bev_known"])}

    def _cell_losses(self, answer: Answer, batch: Batch) -> Tensor:
        losses: Tensor = self.cell_loss(answer["logits"], batch["bev"])
        return losses

    def predict(self, batch: Batch) -> Prediction:
        """Probabilities on the shards' grid."""
        own = self.answer(batch)["logits"].sigmoid()
        return Prediction(own.repeat_interleave(self.factor, -2).repeat_interleave(self.factor, -1))


class VedSystem(OwnGridSystem):
    """Variational encoder–decoders (Lu et al. 2019): one for each target, which share nothing.

    Trained side by side they are as trained apart: no weight, statistic or optimiser state is common to both.
    """

    settings: VedTraining

    def __init__(self, settings: VedTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.nets = nn.ModuleDict(
            {
                name: VedNet(
                    settings.encoder, settings.encoder_weights, settings.image_size, self.own_grid.shape
                )
                for name in TARGETS
            }
        )

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images; no homography takes part."""
        del homography
        return SampleSpec(self.settings.image_size)

    def answer(self, batch: Batch) -> Answer:
        """Logits on the own grid, and each model's latent distribution: `mu`, `logvar`, (B, 2, L)."""
        logits, mu, logvar = zip(*(self.nets[name](batch["image"]) for name in TARGETS), strict=True)
        return {"logits": torch.cat(logits, 1), "mu": torch.stack(mu, 1), "logvar": torch.stack(logvar, 1)}

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """Of each model, its negative evidence lower bound a cell."""
        losses = self._cell_losses(answer, batch)
        return {
            name: elbo(
                losses[:, [channel]],
                batch["bev_known"],
                answer["mu"][:, channel],
                answer["logvar"][:, channel],
                self.settings.kl_weight,
            )
            for channel, name in enumerate(TARGETS)
        }

    def pictures(self, batch: Batch) -> Shown:
        """The image before the cells."""
        return super().pictures(batch).after("image", batch["image"])


class OftSystem(OwnGridSystem):
    """Orthographic Feature Transform (Roddick et al. 2019)."""

    settings: OftTraining

    def __init__(self, settings: OftTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.net = OftNet(
            settings.encoder,
            settings.encoder_weights,
            self.own_grid,
            channels=settings.channels,
            blocks=settings.blocks,
        )

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images and calibration."""
        del homography
        return SampleSpec(self.settings.image_size, calibration=True)

    def answer(self, batch: Batch) -> Answer:
        """Logits on the own grid."""
        return {"logits": self.net(batch["image"], batch["intrinsics"], batch["level_from_camera"])}

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """Summed over cells, as the publication has it: its learning rate of 1e-7 belongs to sums."""
        return {"perception": summed_perception_loss(self._cell_losses(answer, batch), batch["bev_known"])}

    def pictures(self, batch: Batch) -> Shown:
        """The image before the cells."""
        return super().pictures(batch).after("image", batch["image"])


class BevLidarSystem(OwnGridSystem):
    """DeepLab v3+ on an image of the LiDAR points from above (the paper's BEV-LiDAR)."""

    settings: BevLidarTraining

    def __init__(self, settings: BevLidarTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        self.net = FootprintNet(settings.encoder, settings.encoder_weights, normalise=False)

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """LiDAR only."""
        del homography
        return SampleSpec(bev_cell_m=self.cell_m, lidar=True)

    def answer(self, batch: Batch) -> Answer:
        """Logits on the own grid."""
        return {"logits": self.net(batch["lidar"])}

    def pictures(self, batch: Batch) -> Shown:
        """The LiDAR image before the cells."""
        return super().pictures(batch).after("LiDAR from above", batch["lidar"])
