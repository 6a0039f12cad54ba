"""Settings of a training: the paper's by default, one flat record that is also the YAML file's content."""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Self, get_args

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError

PlannerName = Literal["lstm-ed", "end-to-end", "mid-to-end", "holistic", "holistic-cv"]
SystemName = Literal["homography", "footprints", "ved", "oft", "bev-lidar", PlannerName]
Head = Literal["entries", "four-point"]
Optimizer = Literal["sgd", "adamw"]
Schedule = Literal["constant", "cosine"]
Precision = Literal["32-true", "16-mixed", "bf16-mixed"]


_UNSET: Any = None
"""Default of what depends on the system, which is filled in on construction."""
_CHOICES = (("head", Head), ("optimizer", Optimizer), ("schedule", Schedule), ("precision", Precision))

PLANNERS: tuple[str, ...] = get_args(PlannerName)
HOLISTIC = ("holistic", "holistic-cv")
"""Planners with a footprint network inside."""
SYSTEMS: tuple[str, ...] = get_args(SystemName)

_ENCODERS: Mapping[str, str] = {"homography": "resnet18", "ved": "vgg16_bn", "oft": "resnet18"}
_DEEP = "resnet101"
_LEARNING_RATES: Mapping[str, float] = {"oft": 1e-7}
_BEV_CELLS_M: Mapping[str, float] = {"oft": 1.0}
_STAGE_1 = {"epochs": 100, "batch_size": 8, "clip_norm": 0.0}
_STAGE_2 = {"epochs": 200, "batch_size": 10, "clip_norm": 1.0}


@dataclass(frozen=True)
class TrainSettings:
    """What to train, and how (design.md §4). None where the system's default is filled in.

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
        masks: set of camera-view masks (`footprints` and the holistic planners).
        target: homography source that is learnt (`homography`).
        head: what the homography net gives: matrix entries or four points.
        bev_cell_m: side of the cells that `ved`, `oft` and `bev-lidar` work on; None is the shards' own, and
            1 m for `oft`.
        bev_loss: also a loss in BEV, which the paper found to diverge (`footprints`).
        kl_weight: of the latent's divergence from the prior (`ved`).
        channels: of the features of `oft`.
        blocks: residual blocks of the top-down network of `oft`.
        no_past: leave the past trajectory out of what a planner sees.
        pool: (rows, columns) that masks are averaged to, at most, before a planner sees them.
        hidden: size of the states of a planner's LSTMs.
        warp: homography source that leads to BEV (`holistic`).
        perception: run of `footprints`, or checkpoint, that a holistic planner's perception begins with.
        freeze: leave the perception as it began.
        perception_weight: of the perception's loss beside the motion's (the holistic planners).
        checkpoint_gradients: keep of encoders' blocks only what goes in, and work the rest out again for the
            gradients: less memory, more time (planners that see images).
        epochs: passes over the training frames.
        batch_size: frames (of planners, sequences) a step; with `accumulate`, of each part.
        accumulate: batches whose gradients make one step.
        optimizer: how weights are moved.
        lr: learning rate.
        schedule: of the learning rate over all steps: constant, or down to 0 along a cosine.
        momentum: of `sgd`.
        weight_decay: of all weights.
        clip_norm: that a step's gradients are scaled down to if theirs is larger; 0 leaves them.
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
    no_past: bool = False
    pool: tuple[int, int] = (100, 55)
    hidden: int = 128
    warp: str = "network"
    perception: str | None = None
    freeze: bool = False
    perception_weight: float = 0.1
    checkpoint_gradients: bool = False
    epochs: int = field(default=_UNSET)
    batch_size: int = field(default=_UNSET)
    accumulate: int = 1
    optimizer: Optimizer = "sgd"
    lr: float = field(default=_UNSET)
    schedule: Schedule = "constant"
    momentum: float = 0.9
    weight_decay: float = 0.0
    clip_norm: float = field(default=_UNSET)
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
        if self.system not in SYSTEMS:
            raise SettingsError(unknown("system", self.system, SYSTEMS))
        defaults = {
            "lr": _LEARNING_RATES.get(self.system, 1e-3),
            **(_STAGE_2 if self.system in PLANNERS else _STAGE_1),
        }
        own = {
            "encoder": self.encoder or _ENCODERS.get(self.system, _DEEP),
            "bev_cell_m": self.bev_cell_m or _BEV_CELLS_M.get(self.system),
            **{name: value for name, value in defaults.items() if getattr(self, name) is None},
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
        if self.no_past and self.system == "lstm-ed":
            raise SettingsError("lstm-ed sees the past alone: it can't be trained with no_past")
        if self.freeze and self.perception is None:
            raise SettingsError("freeze: needs a perception run whose weights are kept")

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
            ("rows or columns to pool to", min(self.pool), 1, many),
            ("hidden", self.hidden, 1, 65536),
            ("weight of the perception's loss", self.perception_weight, 0, many),
            ("epochs", self.epochs, 1, many),
            ("batch size", self.batch_size, 1, 1e5),
            ("accumulate", self.accumulate, 1, 1e5),
            ("learning rate", self.lr, 0, 1e3),
            ("momentum", self.momentum, 0, 1),
            ("weight decay", self.weight_decay, 0, 1),
            ("norm of gradients", self.clip_norm, 0, many),
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
