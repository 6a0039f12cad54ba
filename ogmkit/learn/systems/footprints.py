"""The paper's stage 1: masks in camera view, warped to BEV by a homography (Footprint segmentation)."""

from torch import Tensor

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.models.footprint_net import FootprintNet
from ogmkit.learn.models.losses import perception_loss
from ogmkit.learn.models.warp import warp_to_bev
from ogmkit.learn.perception_settings import FootprintsTraining
from ogmkit.learn.systems.base import Answer, Batch, Prediction
from ogmkit.learn.systems.masks import MaskSystem
from ogmkit.learn.systems.shown import Shown
from ogmkit.samples.spec import SampleSpec


class FootprintSystem(MaskSystem):
    """DeepLab v3+ with two decoding heads; its loss is in camera view, unless `bev_loss` adds the other."""

    settings: FootprintsTraining

    def __init__(self, settings: FootprintsTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        super().__init__(settings, grid, cameras)
        if settings.masks is None:
            raise SettingsError("masks: name the set of footprints to learn")
        self.net = FootprintNet(settings.encoder, settings.encoder_weights, width=settings.decoder_width)

    @property
    def spec(self) -> SampleSpec:
        """Images and masks; the loss in BEV needs the truth there, and the homography that leads there."""
        settings = self.settings
        if not settings.bev_loss:
            return SampleSpec(settings.image_size, masks=settings.masks)
        return SampleSpec(
            settings.image_size,
            masks=settings.masks,
            homography=settings.target,
            bev_cell_m=self.grid.m_per_cell,
            bev=True,
        )

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images, and homographies where the masks go to BEV."""
        return SampleSpec(self.settings.image_size, homography=homography)

    def answer(self, batch: Batch) -> Answer:
        """Logits in camera view."""
        return {"logits": self.net(batch["image"])}

    def truth(self, batch: Batch) -> tuple[Tensor, Tensor | None]:
        """Masks in camera view."""
        return batch["masks"], batch.get("masks_known")

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """Sum of two binary cross-entropies, in camera view and, where asked for, in BEV."""
        logits, (masks, known) = answer["logits"], self.truth(batch)
        terms = {"perception": perception_loss(self.cell_loss(logits, masks), known)}
        if self.settings.bev_loss:
            warped = warp_to_bev(logits.sigmoid(), batch["bev_from_image"], self.grid.shape)
            chances = warped.clamp(1e-6, 1 - 1e-6)
            terms["bev"] = perception_loss(self.cell_loss(chances.logit(), batch["bev"]), batch["bev_known"])
        return terms

    def predict(self, batch: Batch) -> Prediction:
        """Masks in camera view and, where samples bring a homography, warped to BEV."""
        image = self.answer(batch)["logits"].sigmoid()
        if "bev_from_image" not in batch:
            return Prediction(image=image)
        return Prediction(warp_to_bev(image, batch["bev_from_image"], self.grid.shape), image)

    def pictures(self, batch: Batch) -> Shown:
        """The image before the masks."""
        return super().pictures(batch).after("image", batch["image"])
