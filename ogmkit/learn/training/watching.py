"""What a training keeps to look at: figures in a CSV file, pictures."""

from pathlib import Path

import torch
from lightning.pytorch import Callback, LightningModule, Trainer

from ogmkit.drawing.canvas import fit, framed, resize
from ogmkit.drawing.png import write_png
from ogmkit.drawing.sheet import Caption, Heading, Panel, draw_sheet, draw_tile
from ogmkit.learn.figures import Figure, append_figures, read_figures, write_figures
from ogmkit.learn.systems.base import Batch, System
from ogmkit.learn.systems.shown import Shown
from ogmkit.learn.training.events import Events
from ogmkit.typing import UInt8Array

_PANEL_SIZE = 360, 640
_SHEET_WIDTH = 1600
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
            sheet = _draw(pl_module, pl_module.pictures(some), trainer)
        for logger in trainer.loggers:
            if isinstance(logger, Events):
                picture = torch.from_numpy(sheet).permute(2, 0, 1) / 255
                logger.log_picture("samples", picture, trainer.global_step)
        write_png(self._path, sheet)


def _draw(system: System, shown: Shown, trainer: Trainer) -> UInt8Array:
    """A sheet: a tile for each frame, its score above it."""
    tiles = []
    for frame, score in enumerate(shown.scores):
        panels = [Panel(_enlarged(pictures[frame]), title) for title, pictures in shown.panels]
        tiles.append(draw_tile(panels, Caption(f"frame {frame + 1}", "", score)))
    name = system.settings.system
    note = f"step {trainer.global_step}; the first validation frames"
    heading = Heading(name, f"epoch {trainer.current_epoch}", note)
    return draw_sheet(heading, tiles, max(1, _SHEET_WIDTH // tiles[0].shape[1]), shown.groups)


def _enlarged(pixels: UInt8Array) -> UInt8Array:
    """A panel that is high enough to be looked at; planes that are drawn at their size stay as they are."""
    size = fit((pixels.shape[0], pixels.shape[1]), _PANEL_SIZE)
    return pixels if pixels.shape[0] > _PANEL_SIZE[0] else framed(resize(pixels, size))
