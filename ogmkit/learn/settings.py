"""Settings of a training: the paper's by default, one flat record that is also the YAML file's content."""

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Self, get_args

from ogmkit.errors import SettingsError
from ogmkit.nuscenes.names import unknown

SystemName = Literal["homography", "footprints", "ved", "oft", "bev-lidar"]
Head = Literal["entries", "four-point"]
Optimizer = Literal["sgd", "adamw"]
Schedule = Literal["constant", "cosine"]
Precision = Literal["32-true", "16-mixed", "bf16-mixed"]


_CHOICES = (("head", Head), ("optimizer", Optimizer), ("schedule", Schedule), ("precision", Precision))

_ENCODERS: Mapping[str, str] = {
    "homography": "resnet18",
    "footprints": "resnet101",
    "ved": "vgg16_bn",
    "oft": "resnet18",
    "bev-lidar": "resnet101",
}
_LEARNING_RATES: Mapping[str, float] = {"oft": 1e-7}
_BEV_CELLS_M: Mapping[str, float] = {"oft": 1.0}


@dataclass(frozen=True)
class TrainSettings:
    """What to train, and how (DESIGN §4). None where the system's own default is filled in on construction.

    Attributes:
        system: the system's name.
        cameras: channels; empty for all of the shards'.
        train_split: split that is learnt from.
        val_split: split that the best checkpoint is chosen by.
        split_ratio: numbers such as (77, 9): divide the scenes at random, by the seed, instead of taking the
            splits of shards or split file.
        image_size: (height, width) that images are resized to.
        encoder: name among segmentation-models-pytorch's encoders.
        encoder_weights: file of weights, or a name of segmentation-models-pytorch's, which are downloaded;
            None begins at random.
        masks: set of camera-view masks (`footprints`).
        target: homography source that is learnt (`homography`).
        head: what the homography net gives: matrix entries or four points.
        bev_cell_m: side of the cells that `ved`, `oft` and `bev-lidar` work on; None is the shards' own, and
            1 m for `oft`.
        bev_loss: also a loss in BEV, which the paper found to diverge (`footprints`).
        kl_weight: of the latent's divergence from the prior (`ved`).
        channels: of the features of `oft`.
        blocks: residual blocks of the top-down network of `oft`.
        epochs: passes over the training frames.
        batch_size: frames a step; with `accumulate`, of each part.
        accumulate: batches whose gradients make one step.
        optimizer: how weights are moved.
        lr: learning rate.
        schedule: of the learning rate over all steps: constant, or down to 0 along a cosine.
        momentum: of `sgd`.
        weight_decay: of all weights.
        colour: strength of random brightness, contrast and saturation; 0 leaves the images.
        flip: probability of a horizontal flip.
        crop: share of an image's sides that is cut off at random, at most; homographies follow.
        seed: everything random comes from it.
        max_steps: optimiser steps at most; None for no bound.
        limit_frames: use only so many frames of each split, evenly spread; None for all.
        workers: processes that read samples.
        devices: number of GPUs (of processes without one); None is one.
        precision: of arithmetic.
        checkpoint_every: steps between checkpoints: what a kill costs at most.

    Raises:
        SettingsError: a value is unknown or out of range.
    """

    system: SystemName
    cameras: tuple[str, ...] = ()
    train_split: str = "train"
    val_split: str = "val"
    split_ratio: tuple[int, int] | None = None
    image_size: tuple[int, int] = (448, 800)
    encoder: str = ""
    encoder_weights: str | None = None
    masks: str | None = None
    target: str = "surface"
    head: Head = "entries"
    bev_cell_m: float | None = None
    bev_loss: bool = False
    kl_weight: float = 1.0
    channels: int = 256
    blocks: int = 8
    epochs: int = 100
    batch_size: int = 8
    accumulate: int = 1
    optimizer: Optimizer = "sgd"
    lr: float = field(default=math.nan)
    schedule: Schedule = "constant"
    momentum: float = 0.9
    weight_decay: float = 0.0
    colour: float = 0.0
    flip: float = 0.0
    crop: float = 0.0
    seed: int = 0
    max_steps: int | None = None
    limit_frames: int | None = None
    workers: int = 0
    devices: int | None = None
    precision: Precision = "32-true"
    checkpoint_every: int = 500

    def __post_init__(self) -> None:
        if self.system not in get_args(SystemName):
            raise SettingsError(unknown("system", self.system, get_args(SystemName)))
        own = {
            "encoder": self.encoder or _ENCODERS[self.system],
            "lr": _LEARNING_RATES.get(self.system, 1e-3) if math.isnan(self.lr) else self.lr,
            "bev_cell_m": self.bev_cell_m or _BEV_CELLS_M.get(self.system),
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)  # the dataclass way to fill in what depends on others
        for name, known in _CHOICES:
            if getattr(self, name) not in get_args(known):
                raise SettingsError(unknown(name, getattr(self, name), get_args(known)))
        for name, value, low, high in self._ranges():
            if value is not None and not low <= value <= high:
                raise SettingsError(f"{name}: {value} is not between {low:g} and {high:g}")
        if self.train_split == self.val_split:
            raise SettingsError(f"train split and validation split are both {self.val_split!r}")

    def _ranges(self) -> tuple[tuple[str, float | None, float, float], ...]:
        many = 1e9
        return (
            ("image height", self.image_size[0], 32, 8192),
            ("image width", self.image_size[1], 32, 8192),
            ("split ratio", min(self.split_ratio or (1,)), 1, many),
            ("cell of the BEV", self.bev_cell_m, 1e-3, 100),
            ("weight of the KL term", self.kl_weight, 0, many),
            ("channels", self.channels, 8, 4096),
            ("blocks", self.blocks, 0, 64),
            ("epochs", self.epochs, 1, many),
            ("batch size", self.batch_size, 1, 1e5),
            ("accumulate", self.accumulate, 1, 1e5),
            ("learning rate", self.lr, 0, 1e3),
            ("momentum", self.momentum, 0, 1),
            ("weight decay", self.weight_decay, 0, 1),
            ("colour", self.colour, 0, 1),
            ("flip", self.flip, 0, 1),
            ("crop", self.crop, 0, 0.9),
            ("seed", self.seed, 0, 2**31 - 1),
            ("steps", self.max_steps, 1, many),
            ("frames", self.limit_frames, 1, many),
            ("workers", self.workers, 0, 1024),
            ("devices", self.devices, 1, 1024),
            ("steps between checkpoints", self.checkpoint_every, 1, many),
        )

    @property
    def resumable(self) -> frozenset[str]:
        """Names of settings that may change when a training goes on: they say how and how long, not what."""
        how = frozenset({"workers", "checkpoint_every"})
        return how if self.schedule == "cosine" else how | {"epochs", "max_steps"}

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        values: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(self)))
        return values

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`.

        Raises:
            SettingsError: a value is missing, unknown, of another kind or out of range.
        """
        known = {field.name for field in dataclasses.fields(cls)}
        for name in values:
            if name not in known:
                raise SettingsError(unknown("setting", name, sorted(known)))
        plain: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
        }
        try:
            return cls(**plain)
        except SettingsError:
            raise
        except (TypeError, ValueError) as error:
            raise SettingsError(f"settings can't be read ({error})") from error
