"""The first line of a training: what it learns from, where it runs, and whether it resumes."""

from collections.abc import Mapping
from pathlib import Path

from ogmkit.base.names import with_number
from ogmkit.learn.catalogue import entry_of
from ogmkit.learn.data.module import ShardDataModule
from ogmkit.learn.devices import device_name
from ogmkit.learn.settings import TrainSettings
from ogmkit.pipeline.execution import Execution


def first_line(
    settings: TrainSettings,
    data: ShardDataModule,
    scenes: Mapping[str, tuple[str, ...]],
    run: Path,
    step: int,
) -> str:
    """The line.

    Args:
        settings: of the training.
        data: its samples.
        scenes: split → its scenes; the split to learn from first.
        run: the training's folder.
        step: where it resumes; 0 where it begins.
    """
    sample = "sequence" if entry_of(settings.system).plans else "frame"
    train, val = (len(names) for names in scenes.values())
    parts = [
        f"training on {with_number(len(data.train_set), sample)} of {with_number(train, 'scene')}, "
        f"validation on {with_number(len(data.val_set), sample)} of {with_number(val, 'scene')}",
        _device(settings),
        f"reading {Execution(settings.workers).place}",
        str(run),
        *([f"resumed from step {step:,}"] if step else []),
    ]
    return "; ".join(parts)


def _device(settings: TrainSettings) -> str:
    count = settings.devices or 1
    return device_name() if count == 1 else f"{count} × {device_name()}"
