"""Checkpoints of a training: where it stands, so that it can resume exactly there."""

import dataclasses
from pathlib import Path
from typing import Any

from lightning.pytorch import Callback, LightningModule, Trainer

from ogmkit.learn.checkpoints import KEY, AtomicCheckpointIO, Card
from ogmkit.learn.data.loader import EpochBatches
from ogmkit.learn.runs import BEST, LAST
from ogmkit.learn.systems.base import System
from ogmkit.learn.training.interrupts import Interrupted, Interrupts


class Checkpoints(Callback):
    """Saves the last and the best state, and stops at a step's end on Ctrl-C or SIGTERM.

    Args:
        run: the training's folder.
        card: what the checkpoints say of themselves; epoch and batches are filled in.
        batches: the sampler of training batches, which follows the epoch.

    Attributes:
        interrupts: what asks to stop.
        resumed_step: where the training resumed; 0 where it began.
    """

    def __init__(self, run: Path, card: Card, batches: EpochBatches) -> None:
        self._run = run
        self._card = card
        self.interrupts = Interrupts()
        self._batches = batches
        self._done = card.epoch, card.batches
        self._saved_step = 0
        self.resumed_step = 0
        self._best: float | None = None

    @property
    def step(self) -> int:
        """Steps done when the state was last saved."""
        return self._saved_step

    @property
    def best(self) -> float | None:
        """The best score so far; None before the first validation."""
        return self._best

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Take SIGTERM from Lightning."""
        self.interrupts.hold_sigterm()

    def on_train_epoch_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """A whole epoch begins."""
        self._batches.epoch, self._batches.skip = trainer.current_epoch, 0

    def on_train_batch_end(
        self, trainer: Trainer, pl_module: LightningModule, outputs: object, batch: object, batch_idx: int
    ) -> None:
        """Save where it is time to, but never between the parts of an accumulated step."""
        self._done = trainer.current_epoch, batch_idx + 1
        stepped = trainer.global_step > self._saved_step and not trainer.fit_loop._should_accumulate()
        if stepped and not trainer.is_last_batch and not self._ends(trainer):
            self._save_if_due(trainer)  # at the epoch's end and the training's, validation comes first

    def on_validation_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """From here on, Ctrl-C waits for the validation."""
        if not trainer.sanity_checking:
            self.interrupts.begin("validation")

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Save the best state."""
        if trainer.sanity_checking or not isinstance(pl_module, System):
            return
        score = float(trainer.callback_metrics[f"val/{pl_module.score_name}"])
        sign = pl_module.score_sign
        if self._best is None or sign * score > sign * self._best:
            self._best = score
            self._done = trainer.current_epoch + 1, 0
            self._save_best(trainer, pl_module)

    def on_train_epoch_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Save where it is time to, and at the end."""
        self.interrupts.begin("step")
        self._done = trainer.current_epoch + 1, 0
        last_epoch = trainer.current_epoch + 1 >= self._card.settings.epochs
        self._save_if_due(trainer, ends=last_epoch or self._ends(trainer))

    def on_save_checkpoint(
        self, trainer: Trainer, pl_module: LightningModule, checkpoint: dict[str, Any]
    ) -> None:
        """Add what the checkpoint says of itself."""
        checkpoint[KEY] = self._card_now()
        _count_once(checkpoint["loops"]["fit_loop"], *self._done, trainer.global_step)

    def state_dict(self) -> dict[str, Any]:
        """What a resumed training needs to know."""
        return {"best": self._best, "saved_step": self._saved_step}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """The inverse of `state_dict`."""
        self._best = state_dict["best"]
        self._saved_step = self.resumed_step = state_dict["saved_step"]

    def _ends(self, trainer: Trainer) -> bool:
        """Whether the last step was done, be it within an epoch."""
        steps = self._card.settings.max_steps
        return steps is not None and trainer.global_step >= steps

    def _save_if_due(self, trainer: Trainer, *, ends: bool = False) -> None:
        steps = trainer.global_step - self._saved_step
        asked = trainer.strategy.reduce_boolean_decision(self.interrupts.asked, all=False)  # of any process
        if not (ends or asked or steps >= self._card.settings.checkpoint_every):
            return
        self._saved_step = trainer.global_step
        trainer.save_checkpoint(self._run / LAST)
        if asked:
            raise Interrupted

    def _save_best(self, trainer: Trainer, system: System) -> None:
        """Weights only: nothing resumes from there, and the optimiser's state is twice their size."""
        if trainer.is_global_zero:
            content = {"state_dict": system.state_dict(), KEY: self._card_now()}
            AtomicCheckpointIO().save_checkpoint(content, self._run / BEST)

    def _card_now(self) -> dict[str, Any]:
        epoch, batches = self._done
        return dataclasses.replace(self._card, epoch=epoch, batches=batches).to_dict()


def _count_once(loop: dict[str, Any], epochs: int, batches: int, steps: int) -> None:
    """Set what Lightning counts twice where a training resumed from a whole epoch, so that bytes agree."""
    for count in ("total", "current"):
        loop["epoch_progress"][count]["processed"] = epochs
    loop["epoch_loop.state_dict"]["_batches_that_stepped"] = steps - (batches > 0)
