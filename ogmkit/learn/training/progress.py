"""How a training tells where it is."""

import time
from collections.abc import Callable

from lightning.pytorch import Callback, LightningModule, Trainer

from ogmkit.base.names import in_words
from ogmkit.base.news import Found, Passed, State, tell
from ogmkit.learn.systems.base import Batch, System

_UNTIMED_STEPS, _TIMED_STEPS = 2, 8
"""The first steps take longer; as many as then follow tell how long the others will take."""


class Progress(Callback):
    """Tells steps done and in all, with epoch, loss, score and device; and each epoch's result.

    After the first steps it tells how long all will take.

    Args:
        on_progress: called with (steps done, steps in all); also while a validation is under way.
    """

    def __init__(self, on_progress: Callable[[int, int], None] | None) -> None:
        self._on_progress = on_progress
        self._losses: list[float] = []
        self._score = ""
        self._seconds: list[float] = []
        self._since = 0.0

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Tell that the preparations are over."""
        if trainer.is_global_zero:
            tell(State(f"{_epoch(trainer)}, {trainer.strategy.root_device}"))

    def on_train_epoch_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Forget the losses of the epoch before, and the time of its validation."""
        self._losses.clear()
        self._since = time.monotonic()

    def on_train_batch_end(
        self, trainer: Trainer, pl_module: LightningModule, outputs: object, batch: object, batch_idx: int
    ) -> None:
        """Tell of a step."""
        self._losses.append(float(trainer.callback_metrics["train/loss"]))
        self._tell(trainer, f"loss {self._losses[-1]:.4g}{self._score}")
        self._estimate(trainer)

    def on_validation_batch_end(
        self,
        trainer: Trainer,
        pl_module: LightningModule,
        outputs: object,
        batch: Batch,
        batch_idx: int,
        dataloader_idx: int = 0,
    ) -> None:
        """Tell that a validation is what takes its time."""
        if not trainer.sanity_checking:
            self._tell(trainer, f"validating, batch {batch_idx + 1} of {sum(trainer.num_val_batches)}")

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Remember the score."""
        if isinstance(pl_module, System) and not trainer.sanity_checking:
            score = float(trainer.callback_metrics[f"val/{pl_module.score_name}"])
            self._score = f", {pl_module.score_name} {score:.4g}"

    def on_train_epoch_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Tell of the epoch."""
        if trainer.is_global_zero and self._losses:
            loss = sum(self._losses) / len(self._losses)
            tell(Passed(f"{_epoch(trainer)}: loss {loss:.4g}{self._score}"))

    def _estimate(self, trainer: Trainer) -> None:
        """Tell the time that the training takes, once, after some batches of this run."""
        now = time.monotonic()
        if len(self._seconds) == _UNTIMED_STEPS + _TIMED_STEPS or not trainer.is_global_zero:
            return
        self._seconds.append(now - self._since)
        self._since = now
        steps = int(trainer.estimated_stepping_batches) - trainer.global_step
        if len(self._seconds) == _UNTIMED_STEPS + _TIMED_STEPS and steps > 0:
            seconds = sum(self._seconds[_UNTIMED_STEPS:]) / _TIMED_STEPS * trainer.accumulate_grad_batches
            left = in_words(steps * seconds)
            tell(Found(f"{steps:,} steps of {seconds:.2g} s are left: about {left}, and the validations"))

    def _tell(self, trainer: Trainer, how: str) -> None:
        if not trainer.is_global_zero:
            return
        tell(State(f"{_epoch(trainer)}, {how}, {trainer.strategy.root_device}"))
        if self._on_progress is not None:
            self._on_progress(trainer.global_step, int(trainer.estimated_stepping_batches))


def _epoch(trainer: Trainer) -> str:
    return f"epoch {trainer.current_epoch + 1}/{trainer.max_epochs}"
