"""The folder of a training: what it was made with, and whether a training may resume in it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from ogmkit.base.atomic import is_part, output_errors, replacing, write_json
from ogmkit.base.differences import differences
from ogmkit.base.files import read_text
from ogmkit.errors import CheckpointError, OutputError
from ogmkit.learn.settings import TrainSettings

LAST, BEST = "last.ckpt", "best.ckpt"
CONFIG = "config.yaml"
SPLITS = "splits.json"
"""The scenes of both splits, as a split file."""
METRICS = "metrics.csv"
SAMPLES = "samples.png"
TENSORBOARD = "tensorboard"

_MAX_BYTES = 1 << 20


class Plain(Protocol):
    """What can be told in plain JSON values."""

    def to_dict(self) -> dict[str, Any]:
        """Those values."""


def as_yaml(settings: Plain) -> str:
    """Settings as a YAML file has them."""
    import yaml  # noqa: PLC0415  # comes with the extra `train`

    text: str = yaml.safe_dump(settings.to_dict(), sort_keys=False, allow_unicode=True)
    return text


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file.

    Raises:
        CheckpointError: it is absent, too large, no YAML, or no mapping.
    """
    import yaml  # noqa: PLC0415  # comes with the extra `train`

    try:
        content = yaml.safe_load(read_text(path, _MAX_BYTES))
    except OSError as error:
        raise CheckpointError(f"{path}: can't be read ({error.strerror}); choose another file") from error
    except (yaml.YAMLError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CheckpointError(f"{path}: not YAML ({reason}); correct it") from error
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise CheckpointError(f"{path}: not a mapping of setting: value; correct it")
    return content


def open_folder(
    run: Path,
    settings: TrainSettings,
    scenes: Mapping[str, tuple[str, ...]],
    *,
    overwrite: bool,
) -> None:
    """Make the folder of a training, or find that a training of the same settings may resume in it.

    Args:
        run: the folder.
        settings: of the training.
        scenes: split → its scenes.
        overwrite: start over where a training exists.

    Raises:
        OutputError: the folder holds something else, or a training with other settings or scenes.
    """
    with output_errors(run):
        run.mkdir(parents=True, exist_ok=True)
    if overwrite:
        _require_training(run)
        _clear(run)
    else:
        require_resumable(run, settings, scenes)
    with replacing(run / CONFIG) as part:
        part.write_text(as_yaml(settings), encoding="utf-8")
    write_json(run / SPLITS, scenes)


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


def _require_training(run: Path) -> bool:
    """Refuse a folder that holds something else than a training; tell whether it holds one.

    Raises:
        OutputError: it does.
    """
    with output_errors(run):
        # A kill at the wrong moment leaves these two of a training that had just begun.
        names = {path.name for path in run.iterdir() if not is_part(path)} - {TENSORBOARD}
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
    if (run / SPLITS).is_file():
        known = {split: tuple(names) for split, names in read_yaml(run / SPLITS).items()}
        if known != dict(scenes):
            raise OutputError(f"{run}: a training on other scenes exists; use --overwrite or another --out")


def _clear(run: Path) -> None:
    """Remove what a training wrote, and nothing else; the settings last, by which it is known."""
    with output_errors(run):
        for path in (run / TENSORBOARD).glob("events.out.tfevents.*"):
            path.unlink()
        for name in (LAST, BEST, METRICS, SAMPLES, SPLITS, CONFIG):
            (run / name).unlink(missing_ok=True)
