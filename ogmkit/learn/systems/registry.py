"""Networks of the catalogue's systems."""

import importlib

from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import System


def system_class(name: str) -> type[System]:
    """The class of a system of the catalogue."""
    module, _, implementation = CATALOGUE[name].implementation.partition(":")
    found: type[System] = getattr(importlib.import_module(module), implementation)
    return found


def build_system(settings: TrainSettings, grid: GridSpec, cameras: tuple[str, ...]) -> System:
    """The system that the settings are of, with fresh weights.

    Args:
        settings: of the training.
        grid: of the shards.
        cameras: channels, in the order that samples number them.

    Raises:
        SettingsError: settings and grid don't go together, or the encoder is unknown.
    """
    return system_class(settings.system)(settings, grid, cameras)
