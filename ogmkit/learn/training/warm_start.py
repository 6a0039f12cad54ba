"""Starting from what another run has learnt: all that fits, or the perception of a holistic planner."""

from collections import Counter
from collections.abc import Collection
from pathlib import Path

from ogmkit.base.differences import differences
from ogmkit.base.names import with_number
from ogmkit.base.news import Passed, tell
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.checkpoints import Card, read_checkpoint
from ogmkit.learn.models.weights import require_finite
from ogmkit.learn.perception_settings import PERCEPTION_SHAPE, FootprintsTraining
from ogmkit.learn.planner_settings import HolisticTraining
from ogmkit.learn.runs import checkpoint_file
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import System

_THERE, _HERE = "net.", "perception."
"""What names of the weights begin with in the run of footprints, and in the planner."""
_SHOWN = 4
"""Modules that a line names."""


def require_perception(settings: TrainSettings, grid: GridSpec) -> TrainSettings:
    """Check that a training can begin with the perception that its settings name, if they name one.

    Args:
        settings: of the training, with masks filled in.
        grid: the shards'.

    Returns:
        The settings.

    Raises:
        SettingsError: the run has another grid, encoder or width of decoders.
        CheckpointError: there is none, or it is damaged or of another system.
    """
    if not isinstance(settings, HolisticTraining) or settings.perception is None:
        return settings
    card, _ = read_checkpoint(checkpoint_file(Path(settings.perception)))
    _require_fit(settings.perception, card, settings, grid)
    return settings


def warm_start(system: System) -> None:
    """Copy weights into a fresh system, where its settings name runs.

    The system knows by `System.loaded` what it was given; `System.prepare` learns the rest from the samples.

    Raises:
        CheckpointError: a run is gone or damaged, or its weights don't fit.
    """
    settings = system.settings
    if settings.init is not None:
        _start_from(system, Path(settings.init))
    if not isinstance(settings, HolisticTraining) or settings.perception is None:
        return
    file = checkpoint_file(Path(settings.perception))
    _, content = read_checkpoint(file)
    found = content["state_dict"]
    weights = {
        _HERE + name.removeprefix(_THERE): value for name, value in found.items() if name.startswith(_THERE)
    }
    require_finite(file, weights)
    try:
        unfilled = system.load_state_dict(weights, strict=False)
    except RuntimeError as error:
        raise CheckpointError(f"{file}: its weights don't fit ({str(error).splitlines()[0]})") from error
    missing = [name for name in unfilled.missing_keys if name.startswith(_HERE)]
    if missing or unfilled.unexpected_keys:
        name = (missing or unfilled.unexpected_keys)[0]
        raise CheckpointError(f"{file}: its weights don't fit ({name}); train footprints again")


def _start_from(system: System, run: Path) -> None:
    """Take what has the same name and shape, and say what that is."""
    file = checkpoint_file(run)
    card, content = read_checkpoint(file)
    own, found = system.state_dict(), content["state_dict"]
    fitting = {name: value for name, value in found.items() if name in own and own[name].shape == value.shape}
    there = card.settings.system
    if not fitting:
        raise CheckpointError(
            f"{run}: no weight of {there} fits this {system.settings.system}; choose another run"
        )
    require_finite(file, fitting)
    system.load_state_dict(fitting, strict=False)
    system.loaded = frozenset(fitting)
    told = [f"{len(fitting)} of {len(own)} tensors from {run} ({there})"]
    told += _named("not there", own.keys() - fitting.keys())
    told += _named("not used", found.keys() - fitting.keys())
    tell(Passed("; ".join(told)))


def _named(what: str, names: Collection[str]) -> list[str]:
    """`not there: net.head (2 tensors), …` by module; nothing of no names."""
    counts = Counter(name.rpartition(".")[0] or name for name in names)
    shown = [f"{module} ({with_number(count, 'tensor')})" for module, count in sorted(counts.items())]
    more = [f"{len(shown) - _SHOWN} more modules"] if len(shown) > _SHOWN else []
    return [f"{what}: {', '.join([*shown[:_SHOWN], *more])}"] if shown else []


def _require_fit(path: str, card: Card, settings: HolisticTraining, grid: GridSpec) -> None:
    there = card.settings
    if not isinstance(there, FootprintsTraining):
        raise CheckpointError(f"{path}: is a run of {there.system}, not of footprints; choose another")
    different = differences({"grid": vars(card.grid)}, {"grid": vars(grid)})
    if different:
        raise SettingsError(
            f"{path}: was trained on another grid than the shards have: {', '.join(different)}; train "
            "footprints on these shards"
        )
    for name in PERCEPTION_SHAPE:
        found, wanted = getattr(there, name), getattr(settings, name)
        if found != wanted:
            option = name.replace("_", "-")
            raise SettingsError(f"{path}: has {name} {found}, not {wanted}; choose --{option} {found}")
