"""Beginning a holistic planner with the perception that a run of footprints has learnt."""

from pathlib import Path

from ogmkit.base.differences import differences
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.checkpoints import Card, read_checkpoint
from ogmkit.learn.perception_settings import FootprintsTraining
from ogmkit.learn.planner_settings import HolisticTraining
from ogmkit.learn.runs import checkpoint_file
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import System

_THERE, _HERE = "net.", "perception."
"""What names of the weights begin with in the run of footprints, and in the planner."""


def require_perception(settings: TrainSettings, grid: GridSpec) -> TrainSettings:
    """Check that a training can begin with the perception that its settings name, if they name one.

    Args:
        settings: of the training, with masks filled in.
        grid: the shards'.

    Returns:
        The settings.

    Raises:
        SettingsError: the run has another grid or encoder.
        CheckpointError: there is none, or it is damaged or of another system.
    """
    if not isinstance(settings, HolisticTraining) or settings.perception is None:
        return settings
    card, _ = read_checkpoint(checkpoint_file(Path(settings.perception)))
    _require_fit(settings.perception, card, settings, grid)
    return settings


def warm_start(system: System) -> None:
    """Copy the perception's weights into a fresh system, where its settings name a run.

    Raises:
        CheckpointError: the run is gone or damaged, or its weights don't fit.
    """
    settings = system.settings
    if not isinstance(settings, HolisticTraining) or settings.perception is None:
        return
    file = checkpoint_file(Path(settings.perception))
    _, content = read_checkpoint(file)
    found = content["state_dict"]
    weights = {
        _HERE + name.removeprefix(_THERE): value for name, value in found.items() if name.startswith(_THERE)
    }
    try:
        unfilled = system.load_state_dict(weights, strict=False)
    except RuntimeError as error:
        raise CheckpointError(f"{file}: its weights don't fit ({str(error).splitlines()[0]})") from error
    missing = [name for name in unfilled.missing_keys if name.startswith(_HERE)]
    if missing or unfilled.unexpected_keys:
        name = (missing or unfilled.unexpected_keys)[0]
        raise CheckpointError(f"{file}: its weights don't fit ({name}); train footprints again")


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
    if there.encoder != settings.encoder:
        raise SettingsError(
            f"{path}: has encoder {there.encoder}, not {settings.encoder}; choose --encoder {there.encoder}"
        )
