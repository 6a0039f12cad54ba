"""The paper's two stages in one: images → footprints → (warp) → planner (paper, Trajectory planning)."""

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import replace

from torch import Tensor
from torch.utils.data import default_collate

from ogmkit.drawing import legend
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.data.tensors import as_float
from ogmkit.learn.models.footprint_net import FootprintNet
from ogmkit.learn.models.losses import CellLoss, perception_loss
from ogmkit.learn.models.recompute import recompute_blocks
from ogmkit.learn.models.warp import warp_to_bev
from ogmkit.learn.planner_settings import HolisticTraining, WarpedTraining
from ogmkit.learn.systems.base import Answer, Batch
from ogmkit.learn.systems.planning import PlannerSystem, pooled, pooled_size
from ogmkit.learn.systems.shown import Shown, mask_colours, rgb
from ogmkit.samples.index import SEQUENCE
from ogmkit.samples.spec import TARGETS, SampleSpec

_OF_FRAMES = ("image", "bev_from_image")
"""What a batch holds of each of the six images that is needed to see it."""


class SeeingSystem(PlannerSystem):
    """A planner behind a footprint network; both learn, unless the network is frozen."""

    settings: HolisticTraining

    def __init__(self, settings: HolisticTraining, grid: GridSpec, cameras: tuple[str, ...]) -> None:
        if settings.masks is None:
            raise SettingsError("masks: name the set of footprints to learn")
        super().__init__(settings, grid, cameras)
        self.perception = FootprintNet(
            settings.encoder, settings.encoder_weights, width=settings.decoder_width
        )
        self.cell_loss = CellLoss(settings.balance, len(TARGETS))
        if settings.checkpoint_gradients:
            recompute_blocks(self.perception.encoder)

    @property
    def spec(self) -> SampleSpec:
        """Images, and the masks that the perception learns."""
        wanted = self.prediction_spec(None)
        masks = None if self.settings.freezes_perception else self.settings.masks
        return SampleSpec(wanted.image_size, masks, wanted.homography, trajectory=True)

    @property
    def image_spec(self) -> SampleSpec:
        """Images."""
        return SampleSpec(self.settings.image_size)

    @property
    def sees_alike(self) -> bool:
        """Whether it sees the same in an image whenever it looks, but for mirrored ones."""
        return self.settings.freezes_perception and not self.settings.changes_images

    @property
    def frame_spec(self) -> SampleSpec:
        """What it needs of a frame to see it."""
        return replace(self.prediction_spec(None), trajectory=False)

    def seen(self, frames: Batch) -> Answer:
        """(B, 2, h, w) `logits` of masks in camera view, and (B, F) `features` that the planner is told."""
        logits = self.perception(frames["image"])
        masks = self.masks_told(logits.sigmoid(), frames)
        return {"logits": logits, "features": pooled(masks, self.settings.pool_cells)}

    @abstractmethod
    def masks_told(self, masks: Tensor, frames: Batch) -> Tensor:
        """(B, 2, h, w) probabilities in camera view, or (B, 2, rows, columns) where that is on the plane."""

    def observed(self, batch: Batch) -> Answer:
        """What is seen in all six images; features may have been found before."""
        if "features" in batch:
            return {"features": batch["features"]}
        seen = self.seen({name: value.flatten(0, 1) for name, value in batch.items() if name in _OF_FRAMES})
        return {**seen, "features": seen["features"].reshape(-1, SEQUENCE, self.feature_size())}

    def look(self, batch: Batch) -> None:
        """The perception's look."""
        self.perception(batch["image"])

    @property
    def prepare_spec(self) -> SampleSpec | None:
        """Trajectories; and the masks, where their classes are weighted."""
        if not self._weighs:
            return super().prepare_spec
        return replace(self.spec, image=False, homography=None)

    def prepare(self, samples: Iterable[Batch]) -> None:
        """Learn the coordinates' statistics, and weigh the classes."""
        kept: list[Batch] = []
        if self._weighs:
            self.cell_loss.fit(_six_truths(batch) for batch in _trajectories(samples, kept))
        super().prepare(kept or samples)

    @property
    def _weighs(self) -> bool:
        return self.settings.balance == "weighted" and not self.settings.freezes_perception

    def losses(self, answer: Answer, batch: Batch) -> dict[str, Tensor]:
        """The motion's loss and, with its weight, the perception's over all six images."""
        terms = super().losses(answer, batch)
        if "masks" in batch:
            masks, known = _six_truths(batch)
            found = perception_loss(self.cell_loss(answer["logits"], masks), known)
            terms["perception"] = self.settings.perception_weight * found
        return terms

    def pictures(self, batch: Batch) -> Shown:
        """The last image and the masks seen in it before the trajectories."""
        if "image" not in batch:
            batch = self._with_images(batch)
        last = batch["image"][:, -1]
        shown = super().pictures(batch)
        masks = "masks seen", mask_colours(self.perception(last).sigmoid())
        panels = ("last image", rgb(last)), masks, *shown.panels
        return replace(shown, panels=panels, groups=(legend.IMAGE, *shown.groups))

    def _with_images(self, batch: Batch) -> Batch:
        """A batch of the validation whose images weren't read, with them."""
        samples = self.trainer.datamodule.val_set  # type: ignore[attr-defined]  # a ShardDataModule
        whole = as_float(default_collate([samples.whole(int(index)) for index in batch["index"]]))
        return batch | {name: value.to(self.device) for name, value in whole.items() if name in _OF_FRAMES}


class HolisticSystem(SeeingSystem):
    """Holistic end-to-end: masks are warped to BEV by a homography before the planner sees them."""

    settings: WarpedTraining

    def feature_size(self) -> int:
        """Of both masks on the plane, pooled."""
        return pooled_size(self.grid.shape, self.settings.pool_cells)

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images, homographies and trajectories."""
        source = homography or self.settings.warp
        return SampleSpec(self.settings.image_size, homography=source, trajectory=True)

    def masks_told(self, masks: Tensor, frames: Batch) -> Tensor:
        """Warped to the plane."""
        return warp_to_bev(masks, frames["bev_from_image"], self.grid.shape)


class HolisticCvSystem(SeeingSystem):
    """Holistic end-to-end CV: the planner sees the masks as they are in camera view."""

    def feature_size(self) -> int:
        """Of both masks in the image, pooled."""
        return pooled_size(self.settings.image_size, self.settings.pool_cells)

    def prediction_spec(self, homography: str | None) -> SampleSpec:
        """Images and trajectories."""
        del homography
        return SampleSpec(self.settings.image_size, trajectory=True)

    def masks_told(self, masks: Tensor, frames: Batch) -> Tensor:
        """As they are."""
        del frames
        return masks


def _six_truths(batch: Batch) -> tuple[Tensor, Tensor | None]:
    """Masks of all six images, (B · 6, 2, h, w), and where they are known."""
    known = batch["masks_known"].flatten(0, 1) if "masks_known" in batch else None
    return batch["masks"].flatten(0, 1), known


def _trajectories(samples: Iterable[Batch], kept: list[Batch]) -> Iterator[Batch]:
    """The samples one after the other; of each, what a planner's statistics need is kept."""
    for batch in samples:
        kept.append({name: batch[name] for name in ("positions", "future")})
        yield batch
