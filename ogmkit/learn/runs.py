"""The folder of a training: what it was made with, and whether a training may resume in it."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from ogmkit.base.atomic import output_errors, replacing, write_json
from ogmkit.base.differences import differences
from ogmkit.base.locks import locked
from ogmkit.base.parts import is_part
from ogmkit.errors import CheckpointError, OutputError
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.yaml_files import as_yaml, read_yaml
from ogmkit.nuscenes.splits import read_split_file
from ogmkit.samples.splits import TEST

LAST, BEST = "last.ckpt", "best.ckpt"
CONFIG = "config.yaml"
SPLITS = "splits.json"
"""The scenes that were learnt from, that chose the checkpoint, and others to report, if any: a split file."""
ADAPTED = "adapted"
"""There, the scenes whose images gave the statistics of batch normalisation, if not those of the training."""
METRICS = "metrics.csv"
SAMPLES = "samples.png"
TENSORBOARD = "tensorboard"

LOCK = ".ogmkit-train.lock"
"""Stands there while a training holds the folder; a killed one leaves it, and it holds nobody up."""


@contextmanager
def open_folder(
    run: Path,
    settings: TrainSettings,
    scenes: Mapping[str, tuple[str, ...]],
    *,
    overwrite: bool,
) -> Iterator[None]:
    """Hold the folder of one training: made, or found to hold one of the same settings, which may resume.

    Args:
        run: the folder.
        settings: of the training.
        scenes: split → its scenes.
        overwrite: start over where a training exists.

    Raises:
        OutputError: the folder holds something else, or a training with other settings or scenes, or one
            that is under way.
    """
    if run.exists():
        _require_training(run)
    with locked(run, LOCK):
        if overwrite:
            _clear(run)
        else:
            require_resumable(run, settings, scenes)
        with replacing(run / CONFIG) as part:
            part.write_text(as_yaml(settings), encoding="utf-8")
        write_json(run / SPLITS, scenes)
        yield


def require_resumable(run: Path, settings: TrainSettings, scenes: Mapping[str, tuple[str, ...]]) -> None:
    """Refuse a folder in which a training can neither begin nor resume; writes nothing.

    Args:
        run: the folder; may be absent.
        settings: of the training.
        scenes: split → its scenes.

    Raises:
        OutputError: the folder holds something else, or a training with other settings or scenes.
    """
    if run.exists() and _require_training(run):
        _require_same(run, settings, scenes)


def require_vacant(run: Path) -> None:
    """Refuse a folder in which no new RUN may be made; writes nothing.

    Raises:
        OutputError: it holds a checkpoint, or something else than a RUN's files.
    """
    if not run.exists():
        return
    _require_training(run)
    if any((run / name).exists() for name in (BEST, LAST)):
        raise OutputError(f"{run}: holds a checkpoint already; choose another --out")


def checkpoint_file(path: Path) -> Path:
    """The checkpoint that a path means: itself, or the best one of a RUN folder.

    Raises:
        CheckpointError: there is none.
    """
    if path.is_file():
        return path
    for name in (BEST, LAST):
        if (path / name).is_file():
            return path / name
    raise CheckpointError(f"{path}: not a checkpoint, and holds none; choose a RUN that `ogmkit train` wrote")


def scenes_of(checkpoint: Path) -> dict[str, tuple[str, ...]]:
    """Split → scenes of the training that a checkpoint comes from; none where its folder doesn't say.

    Raises:
        TableError: the list is damaged.
    """
    path = checkpoint.parent / SPLITS
    return read_split_file(path) if path.is_file() else {}


def _require_training(run: Path) -> bool:
    """Refuse a folder that holds something else than a training; tell whether it holds one.

    Raises:
        OutputError: it does.
    """
    with output_errors(run):
        # A kill at the wrong moment leaves these of a training that had just begun.
        names = {path.name for path in run.iterdir() if not is_part(path)} - {TENSORBOARD, LOCK}
    if names and CONFIG not in names:
        raise OutputError(f"{run}: is not empty, and no training made it; choose another --out")
    return bool(names)


def _require_same(run: Path, settings: TrainSettings, scenes: Mapping[str, tuple[str, ...]]) -> None:
    there, here = read_yaml(run / CONFIG), settings.to_dict()
    for name in settings.resumable:
        there.pop(name, None)
        here.pop(name, None)
    different = differences(here, there)
    if different:
        raise OutputError(
            f"{run}: a training with other settings exists: {', '.join(different)}; "
            "use --overwrite or another --out"
        )
    if (run / SPLITS).is_file() and _trained(read_split_file(run / SPLITS)) != _trained(scenes):
        raise OutputError(f"{run}: a training on other scenes exists; use --overwrite or another --out")


def _trained(scenes: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """All scenes but those that are left to report, which may become more."""
    return {split: names for split, names in scenes.items() if split != TEST}


def _clear(run: Path) -> None:
    """Remove what a training wrote, and nothing else; the settings last, by which it is known."""
    with output_errors(run):
        for path in (run / TENSORBOARD).glob("events.out.tfevents.*"):
            path.unlink()
        for name in (LAST, BEST, METRICS, SAMPLES, SPLITS, CONFIG):
            (run / name).unlink(missing_ok=True)
