"""Presets: settings that go together, for machines and evenings of different size."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.learn.catalogue import SystemEntry

_SMALL: dict[str, Any] = {
    "encoder": "resnet18",
    "image_size": (224, 400),
    "bev_cell_m": 0.5,
    "channels": 64,
    "blocks": 4,
    "balance": "weighted",
    "flip": 0.5,
    "colour": 0.2,
    "pitch_deg": 2.0,
    "roll_deg": 1.0,
    "epochs": 30,
    "optimizer": "adamw",
    "lr": 1e-3,
    "schedule": "one-cycle",
    "precision": "auto",
}
_FAST = {"image_size": (128, 224), "bev_cell_m": 1.0, "channels": 32, "blocks": 2, "epochs": 8}
PRESETS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"paper": {}, "small": _SMALL, "fast": _SMALL | _FAST}
)
"""Name → what differs from the defaults, which are the paper's, wherever a system reads it."""


def preset_values(entry: SystemEntry, name: str) -> dict[str, Any]:
    """What a preset sets for a system.

    The number of epochs is meant for what reads images or points; a planner of trajectories and masks keeps
    its own.

    Raises:
        SettingsError: no preset is called so.
    """
    if name not in PRESETS:
        raise SettingsError(unknown("preset", name, tuple(PRESETS)))
    values = entry.read(PRESETS[name])
    if entry.inputs == "none":
        values.pop("epochs", None)
    return values
