"""What the folder of a training or a checkpoint says of itself: `ogmkit inspect`."""

import csv
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ogmkit.errors import CheckpointError
from ogmkit.learn.runs import BEST, CONFIG, LAST, METRICS, SPLITS, read_yaml


@dataclass(frozen=True)
class Figure:
    """A figure of a training's log.

    Attributes:
        epoch: in which it was written, from 0.
        step: optimiser steps before it.
        name: such as `train/loss` or `val/iou`.
        value: the figure.
    """

    epoch: int
    step: int
    name: str
    value: float


@dataclass(frozen=True)
class RunSummary:
    """The folder of a training.

    Attributes:
        system: what was trained.
        settings: all of them, as plain values.
        scenes: split → names of scenes; empty where the folder doesn't say.
        checkpoints: names of the files that are there, best first.
        figures: the last one of each name.
    """

    system: str
    settings: Mapping[str, Any]
    scenes: Mapping[str, tuple[str, ...]]
    checkpoints: tuple[str, ...]
    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class CheckpointSummary:
    """A checkpoint, without its weights.

    Attributes:
        system: what it is a network of.
        settings: of the training, as plain values.
        grid: of the shards it was trained on, as plain values.
        cameras: channels it was trained on.
        epoch: the current one, from 0.
        package_version: ogmkit's that wrote it.
    """

    system: str
    settings: Mapping[str, Any]
    grid: Mapping[str, Any]
    cameras: tuple[str, ...]
    epoch: int
    package_version: str


def is_run(path: Path) -> bool:
    """Whether a folder is that of a training."""
    return any((path / name).is_file() for name in (BEST, LAST)) or (
        (path / CONFIG).is_file() and (path / SPLITS).is_file()
    )


def is_checkpoint(path: Path) -> bool:
    """Whether a file is a checkpoint by its name or, as torch writes them, a ZIP archive."""
    return path.suffix == ".ckpt" or zipfile.is_zipfile(path)


def summarise_run(run: Path) -> RunSummary:
    """What the folder of a training says of itself; reads no checkpoint.

    Raises:
        CheckpointError: its settings, splits or figures are absent or damaged.
    """
    settings = read_yaml(run / CONFIG)
    splits = read_yaml(run / SPLITS) if (run / SPLITS).is_file() else {}
    return RunSummary(
        system=str(settings.pop("system", "")),
        settings=settings,
        scenes={split: tuple(names) for split, names in splits.items()},
        checkpoints=tuple(name for name in (BEST, LAST) if (run / name).is_file()),
        figures=_last_figures(run / METRICS) if (run / METRICS).is_file() else (),
    )


def summarise_checkpoint(path: Path) -> CheckpointSummary:
    """What a checkpoint says of itself; its weights stay on the disk.

    Raises:
        CheckpointError: it is absent, damaged, or not ogmkit's.
    """
    from ogmkit.learn.checkpoints import read_checkpoint  # noqa: PLC0415  # torch

    card, _ = read_checkpoint(path, mapped=True)
    settings = card.settings.to_dict()
    del settings["system"]
    return CheckpointSummary(
        system=card.settings.system,
        settings=settings,
        grid=asdict(card.grid),
        cameras=card.cameras,
        epoch=card.epoch,
        package_version=card.package_version,
    )


def _last_figures(path: Path) -> tuple[Figure, ...]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [
                Figure(int(row["epoch"]), int(row["step"]), row["name"], float(row["value"]))
                for row in csv.DictReader(file)
            ]
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise CheckpointError(f"{path}: is damaged ({error}); remove it") from error
    return tuple({figure.name: figure for figure in rows}.values())
