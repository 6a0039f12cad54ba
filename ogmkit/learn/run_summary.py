"""What the folder of a training or a checkpoint says of itself: `ogmkit inspect`."""

import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ogmkit.learn.figures import Figure, read_figures
from ogmkit.learn.runs import BEST, CONFIG, LAST, METRICS, SPLITS
from ogmkit.learn.yaml_files import read_yaml
from ogmkit.nuscenes.splits import read_split_file


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
        adapted: as plain values, to which images it was adapted after the training; None where it wasn't.
    """

    system: str
    settings: Mapping[str, Any]
    grid: Mapping[str, Any]
    cameras: tuple[str, ...]
    epoch: int
    package_version: str
    adapted: Mapping[str, Any] | None


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
        CheckpointError: its settings or figures are absent or damaged.
        TableError: its splits are damaged.
    """
    settings = read_yaml(run / CONFIG)
    figures = read_figures(run / METRICS)
    return RunSummary(
        system=str(settings.pop("system", "")),
        settings=settings,
        scenes=read_split_file(run / SPLITS) if (run / SPLITS).is_file() else {},
        checkpoints=tuple(name for name in (BEST, LAST) if (run / name).is_file()),
        figures=tuple({figure.name: figure for figure in figures}.values()),
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
        adapted=None if card.adapted is None else asdict(card.adapted),
    )
