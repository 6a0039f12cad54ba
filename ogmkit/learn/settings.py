"""What every training has: the paper's settings by default, each stated once, in its field."""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

from ogmkit.base.stated import require_stated, setting, stated_fields
from ogmkit.base.values import built
from ogmkit.errors import SettingsError

Optimizer = Literal["sgd", "adamw"]
Schedule = Literal["constant", "cosine", "one-cycle"]
Arithmetic = Literal["32-true", "16-mixed", "bf16-mixed"]
Precision = Literal[Arithmetic, "auto"]
BatchNorm = Literal["batch", "kept"]


@dataclass(frozen=True, kw_only=True)
class TrainSettings:
    """The settings that every system reads (docs/design.md §4); each system's record adds its own.

    Raises:
        SettingsError: a value is unknown or out of range.
    """

    system: ClassVar[str]
    """Name of the system whose record it is."""

    cameras: tuple[str, ...] = setting(
        (), "Camera channel, such as CAM_FRONT.", "Data", form="CHANNEL,…", flag="--camera", unset="all"
    )
    train_split: str | None = setting(
        None, "Split to learn from.", "Data", form="NAME", unset="train, less what val_split takes of it"
    )
    val_split: str | None = setting(
        None,
        "Split that the best checkpoint is chosen by.",
        "Data",
        form="NAME",
        unset="val; where no split test has boxes, some logs of train",
    )
    split_ratio: tuple[int, int] | None = setting(
        None,
        "Divide the scenes at random, such as 77/9; RUN/splits.json is then a --split-file.",
        "Data",
        low=1,
        form="A/B",
        unset="the shards' splits",
    )
    limit_frames: int | None = setting(
        None,
        "Maximum number of frames, or sequences, of each split, evenly spread.",
        "Data",
        low=1,
        unset="all",
    )
    flip: float = setting(0.0, "Probability of a horizontal flip.", "Data", low=0, high=1)
    init: str | None = setting(
        None,
        "Weights that the training starts from, as far as they fit.",
        "Model",
        form="RUN|CHECKPOINT",
        unset="random weights",
    )
    freeze: tuple[str, ...] = setting(
        (), "Part of the network that is not trained, such as encoder.", "Model", form="PART,…", unset="none"
    )
    batch_norm: BatchNorm = setting(
        "batch",
        "Statistics of batch normalisation: of each batch, or kept as they are at the start.",
        "Model",
    )
    epochs: int = setting(100, "Number of passes over the frames, or sequences.", "Optimisation", low=1)
    max_steps: int | None = setting(
        None, "Maximum number of optimiser steps.", "Optimisation", low=1, unset="no bound"
    )
    batch_size: int = setting(
        8, "Frames, or sequences, in a batch; with --accumulate, in each part of one.", "Optimisation", low=1
    )
    accumulate: int = setting(
        1, "Number of batches whose gradients are accumulated for a step.", "Optimisation", low=1
    )
    optimizer: Optimizer = setting("sgd", "Optimiser.", "Optimisation")
    lr: float = setting(1e-3, "Learning rate.", "Optimisation", low=0, high=1e3)
    schedule: Schedule = setting(
        "constant",
        "Schedule of the learning rate: constant, cosine decay to 0, or one cycle that rises to --lr first.",
        "Optimisation",
    )
    warm_up: int = setting(
        0, "Number of steps over which the learning rate rises to --lr.", "Optimisation", low=0
    )
    momentum: float = setting(0.9, "Momentum of sgd.", "Optimisation", low=0, high=1)
    weight_decay: float = setting(0.0, "Weight decay.", "Optimisation", low=0, high=1)
    clip_norm: float = setting(0.0, "Maximum norm of gradients; 0 for no clipping.", "Optimisation", low=0)
    seed: int = setting(0, "Random seed.", "Run", low=0, high=2**31 - 1)
    workers: int = setting(
        1,
        "Number of worker processes that read samples; 0 or 1 reads in this process.",
        "Run",
        low=0,
        high=1024,
    )
    devices: int | None = setting(
        None,
        "Number of GPUs, or of processes on a machine without one; batch size and BatchNorm's statistics are "
        "each one's, so that a step takes so many batches, at the same learning rate.",
        "Run",
        low=1,
        high=1024,
        unset="1",
    )
    precision: Precision = setting(
        "32-true",
        "Precision of the arithmetic; auto is bf16-mixed where the device computes with it, else 32-true.",
        "Run",
    )
    cache_samples: bool = setting(
        False,
        "Keep decoded, resized images and masks in a file in RUN until the training ends.",
        "Run",
    )
    checkpoint_every: int = setting(
        500, "Number of steps between checkpoints: the most that a kill can cost.", "Run", low=1
    )

    def __post_init__(self) -> None:
        require_stated(self)
        train, val = self.splits
        if train == val:
            raise SettingsError(f"train split and validation split are both {val!r}")
        if self.warm_up and self.schedule == "one-cycle":
            raise SettingsError("warm_up: the schedule one-cycle has its own; leave it out")

    @property
    def splits(self) -> tuple[str, str]:
        """Names of the splits that it learns from and chooses the checkpoint by, as the shards have them."""
        return self.train_split or "train", self.val_split or "val"

    @property
    def label(self) -> str:
        """What tables call the system with these settings."""
        return self.system

    @property
    def masks_learnt(self) -> str | None:
        """The set of camera-view masks that the system learns; None for a system without."""
        return None

    @property
    def learns_drivable(self) -> bool:
        """Whether the system learns from, or plans on, the true drivable area."""
        return self.masks_learnt is not None

    @property
    def homographies_read(self) -> Mapping[str, str]:
        """Setting → source of homographies in the shards that the system learns from."""
        return {}

    @property
    def runs_read(self) -> Mapping[str, str]:
        """Setting → run or checkpoint whose weights the training starts from."""
        return {} if self.init is None else {"init": self.init}

    @property
    def resumable(self) -> frozenset[str]:
        """Names of settings that may change when a training resumes: they say how and how long, not what."""
        how = frozenset({"workers", "cache_samples", "checkpoint_every"})
        return how | {"epochs", "max_steps"} if self.schedule == "constant" else how

    def for_prediction(self) -> Self:
        """The settings of a network whose weights are there, and which needs no gradients."""
        return self

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values, `system` first; without later settings at their defaults, as older files are."""
        values: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(self)))
        later = {name for name, stated in stated_fields(type(self)).items() if stated.later}
        for one in dataclasses.fields(self):
            if one.name in later and getattr(self, one.name) == one.default:
                del values[one.name]
        return {"system": self.system, **values}

    @classmethod
    def from_values(cls, values: Mapping[str, Any], where: str = "settings") -> Self:
        """Settings of plain values, without `system`.

        Args:
            values: setting → value; what is left out has its default.
            where: what messages call them.

        Raises:
            SettingsError: a setting is unknown, or a value of another kind or out of range.
        """
        return built(cls, values, where)
