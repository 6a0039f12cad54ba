"""What a training keeps to look at: figures in a CSV file, pictures."""

from pathlib import Path

import numpy as np
import torch
from lightning.pytorch import Callback, LightningModule, Trainer
from PIL import Image
from torch import Tensor
from torch.nn import functional

from ogmkit.base.atomic import replacing
from ogmkit.learn.figures import Figure, append_figures, read_figures, write_figures
from ogmkit.learn.systems.base import Batch, System
from ogmkit.learn.training.events import Events

_PANEL_HEIGHT = 200
_PANELS = 4
"""Frames of a sample picture."""


class Metrics(Callback):
    """Appends figures to a CSV file: epoch, step, name, value."""

    def __init__(self, path: Path, every: int = 10) -> None:
        self._path = path
        self._every = every

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Drop what a killed run wrote beyond the checkpoint that is resumed."""
        if trainer.is_global_zero:
            kept = (figure for figure in read_figures(self._path) if figure.step <= trainer.global_step)
            write_figures(self._path, kept)

    def on_train_batch_end(
        self, trainer: Trainer, pl_module: LightningModule, outputs: object, batch: object, batch_idx: int
    ) -> None:
        """Write the terms of the loss now and then."""
        if trainer.global_step % self._every == 0 and not trainer.fit_loop._should_accumulate():
            self._append(trainer, "train/")

    def on_validation_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Write the scores."""
        if not trainer.sanity_checking:
            self._append(trainer, "val/")

    def _append(self, trainer: Trainer, prefix: str) -> None:
        if not trainer.is_global_zero:
            return
        place = trainer.current_epoch, trainer.global_step
        values = trainer.callback_metrics.items()
        found = (Figure(*place, name, float(value)) for name, value in values if name.startswith(prefix))
        append_figures(self._path, found)


class Samples(Callback):
    """Draws predictions beside the truth of some validation frames, after each validation."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def on_validation_batch_end(
        self,
        trainer: Trainer,
        pl_module: LightningModule,
        outputs: object,
        batch: Batch,
        batch_idx: int,
        dataloader_idx: int = 0,
    ) -> None:
        """Draw the first batch."""
        if batch_idx or trainer.sanity_checking or not trainer.is_global_zero:
            return
        if not isinstance(pl_module, System):
            return
        some = {name: value[:_PANELS] for name, value in batch.items()}
        with torch.no_grad():
            rows = [_row([panel[i] for panel in pl_module.pictures(some)]) for i in range(len(some["index"]))]
        sheet = torch.cat(rows, dim=1).clamp(0, 1).cpu()
        for logger in trainer.loggers:
            if isinstance(logger, Events):
                logger.log_picture("samples", sheet, trainer.global_step)
        _write_picture(self._path, sheet)


def _row(panels: list[Tensor]) -> Tensor:
    """(3, h, w) panels side by side, all of one height, a gap between them."""
    gap = torch.ones(3, _PANEL_HEIGHT, 4)
    parts: list[Tensor] = []
    for panel in panels:
        width = max(1, round(panel.shape[-1] * _PANEL_HEIGHT / panel.shape[-2]))
        shown = functional.interpolate(panel[None].float().cpu(), (_PANEL_HEIGHT, width), mode="area")
        parts += [shown[0], gap]
    return torch.cat(parts[:-1], dim=2)


def _write_picture(path: Path, picture: Tensor) -> None:
    """Write (3, h, w) values 0 … 1 as a PNG file.

    Raises:
        OutputError: the system refuses to write.
    """
    pixels = np.ascontiguousarray((picture * 255).round().to(torch.uint8).permute(1, 2, 0).numpy())
    with replacing(path) as part:
        Image.fromarray(pixels).save(part, format="PNG")
