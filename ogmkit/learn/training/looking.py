"""Where the perception is frozen and images don't change, each is looked at once, before the first step."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Self, TypeGuard

import torch
from lightning.pytorch import Callback, LightningModule, Trainer
from torch import Tensor

from ogmkit.base.names import in_words
from ogmkit.base.news import Found, Passed, Waiting, tell
from ogmkit.base.parts import part_of
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frame_features import FrameFeatures
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.tensors import as_float
from ogmkit.learn.systems.base import Batch, System
from ogmkit.learn.systems.holistic import SeeingSystem
from ogmkit.learn.training.interrupts import Interrupted, Interrupts
from ogmkit.samples.index import SEQUENCE

_TELL_EVERY_S = 10.0
_ALWAYS_FLIPPED = Augmentation(colour=0, flip=1)


def looks_once(system: System) -> TypeGuard[SeeingSystem]:
    """Whether a training looks at each image only once."""
    return isinstance(system, SeeingSystem) and system.sees_alike


class LookingOnce(Callback):
    """Keeps what a frozen perception makes of each frame, for a system that `looks_once`.

    A frame is part of six sequences of every epoch, and of as many with its mirror image: a planner that is
    told features is trained in a small part of the time. Several devices share the frames. Inside it as a
    context, the files are there.

    Args:
        run: the training's folder, for two files.
        interrupts: which stop it.
    """

    def __init__(self, run: Path, interrupts: Interrupts) -> None:
        self._run = run
        self._interrupts = interrupts
        self._made: list[Path] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for path in self._made:
            path.unlink(missing_ok=True)

    def on_fit_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Look at all frames; from here on, the weights are there.

        Raises:
            OutputError: the disk is too full, or can't be written to.
            ShardError, DataFileError: as of any sample.
            Interrupted: Ctrl-C.
        """
        if not isinstance(pl_module, SeeingSystem) or not pl_module.settings.freezes_perception:
            return
        if not pl_module.sees_alike:
            tell(
                Found("the frozen perception runs at every step; without --colour, --pitch and --roll, once")
            )
            return
        data = trainer.datamodule  # type: ignore[attr-defined]  # a ShardDataModule
        flipped = 2 if pl_module.settings.flip > 0 else 1
        for name, samples, mirrors in (
            ("training", data.train_set, flipped),
            ("validation", data.val_set, 1),
        ):
            path = trainer.strategy.broadcast(part_of(self._run / f"features-{name}"))
            features = FrameFeatures(path, samples.index, pl_module.feature_size(), mirrors)
            if trainer.is_global_zero:
                self._made.append(path)
                features.make()
            trainer.strategy.barrier()
            self._fill(trainer, pl_module, features, name)
            trainer.strategy.barrier()
            samples.keep_features(features)

    def _fill(self, trainer: Trainer, system: SeeingSystem, features: FrameFeatures, name: str) -> None:
        """Write the features of all frames; of several devices, this one's share."""
        began, told, done = time.monotonic(), 0.0, 0
        total = len(features.frames) * features.mirrors
        self._interrupts.begin("batch")
        for batch in _batches(trainer, system, features):
            if self._interrupts.asked:
                raise Interrupted
            features.write(
                batch["index"].numpy(), batch["mirrored"].numpy(), _seen(trainer, system, batch).numpy()
            )
            done += len(batch["index"]) * trainer.world_size
            now = time.monotonic()
            if now - told >= _TELL_EVERY_S:
                left = (now - began) / done * (total - done)
                what = f"{min(done, total):,} of {total:,} {name} images, {in_words(left)} left"
                tell(Waiting(f"looking once at each image: {what}"))
                told = now
        self._interrupts.begin("step")
        tell(Passed(f"looked once at {total:,} {name} images, in {in_words(time.monotonic() - began)}"))


def _batches(trainer: Trainer, system: SeeingSystem, features: FrameFeatures) -> Iterator[Batch]:
    """All frames, then their mirror images."""
    settings = system.settings
    for mirrored in range(features.mirrors):
        augment = _ALWAYS_FLIPPED if mirrored else None
        frames = FrameDataset(features.frames, system.frame_spec, augment=augment, compact=True)
        batches = EpochBatches(
            len(frames),
            settings.batch_size * SEQUENCE,
            seed=0,
            shuffle=False,
            rank=trainer.global_rank,
            world=trainer.world_size,
        )
        yield from loader(frames, batches, workers=settings.workers)


def _seen(trainer: Trainer, system: SeeingSystem, batch: Batch) -> Tensor:
    """(B, F) float32 on the CPU."""
    there = as_float({name: value.to(system.device) for name, value in batch.items()})
    with torch.no_grad(), trainer.precision_plugin.val_step_context():
        return system.seen(there)["features"].float().cpu()
