"""The first line of a training: what it learns from, where it runs, and whether it resumes."""

from pathlib import Path

from ogmkit.base.execution import Execution
from ogmkit.base.names import with_number
from ogmkit.learn.catalogue import entry_of
from ogmkit.learn.data.module import ShardDataModule
from ogmkit.learn.devices import arithmetic, best_device, device_name
from ogmkit.learn.perception_settings import ImageTraining
from ogmkit.learn.settings import TrainSettings
from ogmkit.samples.splits import Division

_MOST_PIXELS = 2e10
"""What a small encoder sees in about a day on two cores, at a few 1e5 pixels a second."""


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


def slow_warning(settings: TrainSettings, frames: int) -> str | None:
    """What to say where a training meets a machine that is too small for it; None where it isn't.

    Args:
        settings: of the training.
        frames: that it learns from.
    """
    if not isinstance(settings, ImageTraining) or best_device().type != "cpu":
        return None
    height, width = settings.image_size
    passes = (
        settings.epochs if settings.max_steps is None else settings.max_steps * settings.batch_size / frames
    )
    if frames * passes * height * width < _MOST_PIXELS:
        return None
    return (
        f"no GPU was found: {settings.epochs} passes over {with_number(frames, 'sample')} of images of "
        f"{height}x{width} take days on a CPU; --preset small, fewer --epochs or --limit-frames take less"
    )


def _device(settings: TrainSettings) -> str:
    count, precision = settings.devices or 1, arithmetic(settings.precision)
    name = device_name() if count == 1 else f"{count} × {device_name()}"
    return name if precision == "32-true" else f"{name}, {precision}"
