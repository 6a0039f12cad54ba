"""The catalogue of systems, free of torch: what each reads, sees and predicts.

To add a system: a settings record beside the others, an entry here, the class that it names, tests.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from ogmkit.base.names import unknown
from ogmkit.base.stated import Stated, stated_fields
from ogmkit.errors import SettingsError
from ogmkit.learn.perception_settings import (
    BevLidarTraining,
    FootprintsTraining,
    HomographyTraining,
    OftTraining,
    VedTraining,
)
from ogmkit.learn.planner_settings import (
    EndToEndTraining,
    HolisticTraining,
    LstmTraining,
    MidToEndTraining,
    WarpedTraining,
)
from ogmkit.learn.settings import TrainSettings

Inputs = Literal["images", "lidar", "none"]
Output = Literal["homography", "grids", "plan"]


@dataclass(frozen=True)
class SystemEntry:
    """A system.

    Attributes:
        settings: its record.
        implementation: `module:class`, imported where a network is built.
        output: what it predicts; what plans is of stage 2.
        inputs: files beside shards that it sees.
        help: what it does, for lists of systems.
    """

    settings: type[TrainSettings]
    implementation: str
    output: Output
    inputs: Inputs
    help: str

    @property
    def name(self) -> str:
        """The system's name."""
        return self.settings.system

    def read(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Of settings for several systems, those that this one reads."""
        names = stated_fields(self.settings)
        return {name: value for name, value in values.items() if name in names}

    @property
    def plans(self) -> bool:
        """Whether it is of stage 2."""
        return self.output == "plan"


_SYSTEMS = (
    SystemEntry(
        HomographyTraining,
        "ogmkit.learn.systems.homography:HomographySystem",
        "homography",
        "images",
        "image → homography to BEV",
    ),
    SystemEntry(
        FootprintsTraining,
        "ogmkit.learn.systems.footprints:FootprintSystem",
        "grids",
        "images",
        "image → masks in camera view, warped to BEV: the paper's",
    ),
    SystemEntry(
        VedTraining,
        "ogmkit.learn.systems.own_grid:VedSystem",
        "grids",
        "images",
        "image → BEV through a variational bottleneck, one model a target",
    ),
    SystemEntry(
        OftTraining,
        "ogmkit.learn.systems.own_grid:OftSystem",
        "grids",
        "images",
        "image → BEV through the Orthographic Feature Transform",
    ),
    SystemEntry(
        BevLidarTraining,
        "ogmkit.learn.systems.own_grid:BevLidarSystem",
        "grids",
        "lidar",
        "LiDAR from above → BEV",
    ),
    SystemEntry(
        LstmTraining,
        "ogmkit.learn.systems.planning:TrajectorySystem",
        "plan",
        "none",
        "past trajectory → plan",
    ),
    SystemEntry(
        EndToEndTraining,
        "ogmkit.learn.systems.planning:EndToEndSystem",
        "plan",
        "images",
        "six images → plan",
    ),
    SystemEntry(
        MidToEndTraining,
        "ogmkit.learn.systems.planning:MidToEndSystem",
        "plan",
        "none",
        "true masks on the plane → plan",
    ),
    SystemEntry(
        WarpedTraining,
        "ogmkit.learn.systems.holistic:HolisticSystem",
        "plan",
        "images",
        "six images → footprints, warped to the plane → plan: the paper's",
    ),
    SystemEntry(
        HolisticTraining,
        "ogmkit.learn.systems.holistic:HolisticCvSystem",
        "plan",
        "images",
        "six images → footprints in camera view → plan",
    ),
)

_ENTRIES = {entry.name: entry for entry in _SYSTEMS}
CATALOGUE: Mapping[str, SystemEntry] = MappingProxyType(_ENTRIES)
"""System → what there is to know of it, in the order of work."""


def systems_of(output: Output) -> tuple[str, ...]:
    """The systems that predict this, in the order of work."""
    return tuple(name for name, entry in CATALOGUE.items() if entry.output == output)


def entry_of(system: str) -> SystemEntry:
    """A system's entry.

    Raises:
        SettingsError: no system is called so.
    """
    if system not in CATALOGUE:
        raise SettingsError(unknown("system", system, tuple(CATALOGUE)))
    return CATALOGUE[system]


def settings_from_dict(values: Mapping[str, Any]) -> TrainSettings:
    """The inverse of `TrainSettings.to_dict`.

    Raises:
        SettingsError: a value is missing, unknown, of another kind or out of range.
    """
    own = dict(values)
    entry = entry_of(str(own.pop("system", None)))
    require_read(entry, own)
    return entry.settings.from_values(own)


def all_settings() -> Mapping[str, Stated]:
    """Every setting of any system, by its name."""
    return {
        name: stated for entry in CATALOGUE.values() for name, stated in stated_fields(entry.settings).items()
    }


def readers(setting_name: str) -> tuple[str, ...]:
    """The systems that read a setting."""
    return tuple(name for name, entry in CATALOGUE.items() if setting_name in stated_fields(entry.settings))


def require_read(entry: SystemEntry, values: Mapping[str, Any]) -> None:
    """Refuse a setting that other systems read and this one doesn't.

    Raises:
        SettingsError: there is one; names those that do.
    """
    for name in values:
        found = readers(name)
        if found and entry.name not in found:
            do = "does" if len(found) == 1 else "do"
            raise SettingsError(f"{name}: {entry.name} does not read it; {', '.join(found)} {do}")
