"""Where a training that was cut short stands, and whether its last checkpoint is its own."""

import dataclasses
from pathlib import Path

from ogmkit.base.differences import differences
from ogmkit.errors import CheckpointError
from ogmkit.learn.checkpoints import Card, read_checkpoint

_STATE = ("global_step", "loops", "callbacks", "optimizer_states", "lr_schedulers")
"""What a checkpoint holds besides weights, where a training can resume from it."""
_REMEDY = "put the training's own back, or use --overwrite to start over"


def resumed_from(last: Path, fresh: Card) -> tuple[Card, int]:
    """What a training's checkpoints say of themselves from here on, and the step that it resumes at.

    Args:
        last: its last checkpoint; may be absent.
        fresh: what the checkpoints of a new training say.

    Raises:
        CheckpointError: the checkpoint is damaged, another training's, or holds weights alone.
    """
    if not last.exists():
        return fresh, 0
    there, content = read_checkpoint(last, mapped=True)
    _require_own(last, there, fresh)
    step = content.get("global_step")
    if not isinstance(step, int) or not all(name in content for name in _STATE):
        raise CheckpointError(f"{last}: holds weights alone, as best.ckpt does; {_REMEDY}")
    return dataclasses.replace(fresh, epoch=there.epoch, batches=there.batches), step


def _require_own(last: Path, there: Card, here: Card) -> None:
    if there.settings.system != here.settings.system:
        raise CheckpointError(
            f"{last}: is of {there.settings.system}, not of {here.settings.system}; {_REMEDY}"
        )
    different = differences(_identity(here), _identity(there))
    if different:
        raise CheckpointError(f"{last}: is another training's: {', '.join(different)}; {_REMEDY}")


def _identity(card: Card) -> dict[str, object]:
    """What can't change when a training resumes."""
    values = card.to_dict()
    settings = {
        name: value for name, value in values["settings"].items() if name not in card.settings.resumable
    }
    return {**settings, **{name: values[name] for name in ("grid", "cameras", "step_s")}}
