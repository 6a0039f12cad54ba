"""The settings of the systems of stage 1: what each reads beside what all read."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

from ogmkit.base.stated import setting, with_default
from ogmkit.learn.settings import TrainSettings

Head = Literal["entries", "four-point"]
Balance = Literal["none", "weighted", "focal"]
PERCEPTION_SHAPE = ("encoder", "decoder_width")
"""Settings that footprints and a planner which begins with them have in common, for weights to fit."""


@dataclass(frozen=True, kw_only=True)
class EncoderTraining(TrainSettings):
    """Of a system with an encoder of segmentation-models-pytorch's."""

    encoder: str = setting(
        "resnet101", "Encoder by segmentation-models-pytorch's name.", "Model", form="NAME"
    )
    encoder_weights: str | None = setting(
        None,
        "File of weights; or a name such as imagenet, downloaded unless the extra pretrained has it.",
        "Model",
        form="FILE|NAME",
        unset="random weights",
    )

    encoder_lr: float = setting(
        1.0,
        "Learning rate of the encoder as a factor of --lr.",
        "Optimisation",
        low=0,
        high=1e3,
        form="FACTOR",
    )

    def for_prediction(self) -> Self:
        """Without weights to begin with."""
        return replace(super().for_prediction(), encoder_weights=None)


@dataclass(frozen=True, kw_only=True)
class ImageTraining(EncoderTraining):
    """Of a system that sees images."""

    image_size: tuple[int, int] = setting(
        (448, 800), "Size that images are resized to.", "Data", low=32, high=8192, form="HEIGHTxWIDTH"
    )
    colour: float = setting(
        0.0, "Strength of random brightness, contrast and saturation.", "Data", low=0, high=1
    )
    pitch_deg: float = setting(
        0.0,
        "Angle that the camera is turned up or down by at random, at most; masks and homographies follow.",
        "Data",
        low=0,
        high=45,
        form="DEGREES",
        flag="--pitch",
    )
    roll_deg: float = setting(
        0.0, "The same about its optical axis.", "Data", low=0, high=45, form="DEGREES", flag="--roll"
    )

    @property
    def changes_images(self) -> bool:
        """Whether images of the training change at random, beside being mirrored."""
        return self.colour > 0 or self.pitch_deg > 0 or self.roll_deg > 0


@dataclass(frozen=True, kw_only=True)
class BalancedTraining(TrainSettings):
    """Of a system that learns masks, most of whose cells are of one class."""

    balance: Balance = setting(
        "none",
        "Balance of the classes: none, as in the paper; weighted, by the root of how rare they are; focal.",
        "Optimisation",
    )


@dataclass(frozen=True, kw_only=True)
class MaskTraining(ImageTraining, BalancedTraining):
    """Of a system that learns masks in camera view."""

    masks: str | None = setting(
        None,
        "Set of camera-view masks to learn; full-body is the control.",
        "Data",
        form="SET",
        unset="network if there, else surface",
    )
    decoder_width: int = setting(
        256,  # of Chen et al. 2018
        "Channels of each mask's decoder.",
        "Model",
        low=8,
        high=4096,
        later=True,
    )

    @property
    def masks_learnt(self) -> str | None:
        """The set."""
        return self.masks


@dataclass(frozen=True, kw_only=True)
class HomographyTraining(ImageTraining):
    """Of `homography`."""

    system: ClassVar[str] = "homography"
    encoder: str = with_default(EncoderTraining, "encoder", "resnet18")
    target: str = setting("surface", "Homographies to learn.", "Data", form="SOURCE")
    head: Head = setting(
        "entries", "What is regressed: matrix entries, or where four points of the ground appear.", "Model"
    )

    @property
    def homographies_read(self) -> Mapping[str, str]:
        """The target."""
        return {"target": self.target}


@dataclass(frozen=True, kw_only=True)
class FootprintsTraining(MaskTraining):
    """Of `footprints`."""

    system: ClassVar[str] = "footprints"
    bev_loss: bool = setting(False, "Add a loss in BEV, which the paper found to diverge.", "Optimisation")
    target: str = setting("surface", "Homographies that --bev-loss warps with.", "Data", form="SOURCE")

    @property
    def homographies_read(self) -> Mapping[str, str]:
        """The target, where there is a loss in BEV."""
        return {"target": self.target} if self.bev_loss else {}


@dataclass(frozen=True, kw_only=True)
class OwnGridTraining(EncoderTraining, BalancedTraining):
    """Settings of a system that predicts on its own grid."""

    bev_cell_m: float | None = setting(
        None,
        "Side of the cells that the network works on.",
        "Model",
        low=1e-3,
        high=100,
        form="METRES",
        flag="--bev-cell",
        unset="the shards' cells",
    )

    @property
    def learns_drivable(self) -> bool:
        """It does, from above."""
        return True


@dataclass(frozen=True, kw_only=True)
class VedTraining(ImageTraining, OwnGridTraining):
    """Of `ved`."""

    system: ClassVar[str] = "ved"
    encoder: str = with_default(EncoderTraining, "encoder", "vgg16_bn")
    kl_weight: float = setting(1.0, "Weight of the latent's KL term.", "Optimisation", low=0)


@dataclass(frozen=True, kw_only=True)
class OftTraining(ImageTraining, OwnGridTraining):
    """Of `oft`."""

    system: ClassVar[str] = "oft"
    encoder: str = with_default(EncoderTraining, "encoder", "resnet18")
    bev_cell_m: float | None = with_default(OwnGridTraining, "bev_cell_m", 1.0)
    lr: float = with_default(TrainSettings, "lr", 1e-7)
    channels: int = setting(256, "Channels of the features.", "Model", low=8, high=4096)
    blocks: int = setting(8, "Residual blocks of the top-down network.", "Model", low=0, high=64)


@dataclass(frozen=True, kw_only=True)
class BevLidarTraining(OwnGridTraining):
    """Of `bev-lidar`."""

    system: ClassVar[str] = "bev-lidar"
