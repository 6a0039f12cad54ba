"""The systems by the names that the command line has for them."""

from collections.abc import Mapping
from types import MappingProxyType

from ogmkit.grid import GridSpec
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import System
from ogmkit.learn.systems.footprints import FootprintSystem
from ogmkit.learn.systems.holistic import HolisticCvSystem, HolisticSystem
from ogmkit.learn.systems.homography import HomographySystem
from ogmkit.learn.systems.own_grid import BevLidarSystem, OftSystem, VedSystem
from ogmkit.learn.systems.planning import EndToEndSystem, MidToEndSystem, TrajectorySystem

SYSTEMS: Mapping[str, type[System]] = MappingProxyType(
    {
        "homography": HomographySystem,
        "footprints": FootprintSystem,
        "ved": VedSystem,
        "oft": OftSystem,
        "bev-lidar": BevLidarSystem,
        "lstm-ed": TrajectorySystem,
        "end-to-end": EndToEndSystem,
        "mid-to-end": MidToEndSystem,
        "holistic": HolisticSystem,
        "holistic-cv": HolisticCvSystem,
    }
)


def build_system(settings: TrainSettings, grid: GridSpec, cameras: tuple[str, ...]) -> System:
    """The system that the settings name, with fresh weights.

    Args:
        settings: of the training.
        grid: of the shards.
        cameras: channels, in the order that samples number them.

    Raises:
        SettingsError: settings and grid don't go together, or the encoder is unknown.
    """
    return SYSTEMS[settings.system](settings, grid, cameras)
