"""The first line of a training: what it learns from, where it runs, and whether it resumes."""

from pathlib import Path

from ogmkit.base.names import with_number
from ogmkit.learn.catalogue import entry_of
from ogmkit.learn.data.module import ShardDataModule
from ogmkit.learn.devices import device_name
from ogmkit.learn.settings import TrainSettings
from ogmkit.pipeline.execution import Execution
from ogmkit.samples.splits import Division


def first_line(
    settings: TrainSettings, data: ShardDataModule, division: Division, run: Path, step: int
) -> str:
    """The line.

    Args:
        settings: of the training.
        data: its samples.
        division: of the scenes.
        run: the training's folder.
        step: where it resumes; 0 where it begins.
    """
    sample = "sequence" if entry_of(settings.system).plans else "frame"
    train, val = len(division.train), len(division.val)
    parts = [
        f"training on {with_number(len(data.train_set), sample)} of {with_number(train, 'scene')}, "
        f"validation on {with_number(len(data.val_set), sample)} of {with_number(val, 'scene')}",
        *([division.note] if division.note else []),
        _device(settings),
        f"reading {Execution(settings.workers).place}",
        str(run),
        *([f"resumed from step {step:,}"] if step else []),
    ]
    return "; ".join(parts)


def _device(settings: TrainSettings) -> str:
    count = settings.devices or 1
    return device_name() if count == 1 else f"{count} × {device_name()}"
