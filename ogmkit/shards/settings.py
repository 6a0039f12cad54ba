"""Settings of an extraction: what every shard of a folder has in common."""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

from ogmkit.base.names import unknown
from ogmkit.base.stated import require_stated, setting
from ogmkit.base.steps import GAP_STEPS, STEP_S
from ogmkit.errors import MALFORMED, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.labels.catalogue import definition
from ogmkit.labels.definition import Definition, without_map
from ogmkit.labels.names import NAMES, PAPER
from ogmkit.target_settings import TargetSettings

Compression = Literal["gzip", "lzf", "none"]
"""Of the rasters and LiDAR points. All are part of plain HDF5 but `lzf`, which h5py brings."""


LEAVING_OUT = ("only_complete", "skip_bad_frames")
"""Settings of an extraction that say what it leaves out."""

_LATER = (
    *("min_lidar_points", "step_s", "lidar_channel", "no_map", "seen"),
    *("layers", "line_width_m", "classes", "instances", "flow", "future"),
)
"""Of targets: left out at their defaults, as shards have it that were written before they could be set."""


@dataclass(frozen=True)
class ExtractSettings:
    """What to extract, and how it is stored.

    Attributes:
        targets: what targets to make.

    Raises:
        SettingsError: no camera or definition, one named twice, an unknown definition or compression, or two
            ways to leave things out.
    """

    targets: TargetSettings = field(default_factory=TargetSettings)
    cameras: tuple[str, ...] = setting(
        ("CAM_FRONT",), "Camera channel, such as CAM_FRONT.", form="CHANNEL,…", flag="--camera"
    )
    compression: Compression = setting("gzip", "Of rasters and points; lzf needs h5py to be read.")
    only_complete: bool = setting(False, "Leave out scenes that lack a file, or have a damaged one.")
    skip_bad_frames: bool = setting(
        False, "Leave out frames whose image (or LiDAR sweep) is absent or damaged; trajectories stay whole."
    )
    definitions: tuple[str, ...] = setting(
        (PAPER,),
        f"Labels to store: {', '.join(NAMES)}; all but the first need no camera file.",
        form="NAME,…",
        flag="--definition",
    )

    def __post_init__(self) -> None:
        require_stated(self)
        if not self.paper:
            object.__setattr__(self, "cameras", ())  # labels alone follow the samples
        wanted = {"definitions": self.definitions} | ({"cameras": self.cameras} if self.paper else {})
        for what, names in wanted.items():
            if not names or len(set(names)) != len(names):
                raise SettingsError(f"{what}: {', '.join(names) or 'none'}: name at least one, each once")
        for name in self.definitions:
            if name not in NAMES:
                raise SettingsError(unknown("definition", name, NAMES))
        for one in self.labels:
            if not one.classes:
                raise SettingsError(f"definition {one.name}: has no class without a map; leave it out")
        if self.targets.further and not self.paper:
            raise SettingsError(
                "layers, classes, instances, future: lie beside the paper's labels; add --definition paper"
            )
        if self.only_complete and self.skip_bad_frames:
            raise SettingsError("only_complete, skip_bad_frames: leave out whole scenes or frames, not both")

    @property
    def paper(self) -> bool:
        """Whether the paper's targets are stored; without them there are no cameras' frames."""
        return PAPER in self.definitions

    @property
    def labels(self) -> tuple[Definition, ...]:
        """The definitions besides the paper's; without maps, without the classes that need one."""
        chosen = (definition(name, self.targets) for name in self.definitions if name != PAPER)
        return tuple(without_map(one) if self.targets.no_map else one for one in chosen)

    @property
    def draws_mask(self) -> bool:
        """Whether a definition besides the paper's draws the drivable-area mask."""
        return any(one.cell.layers == "mask" for one in self.labels)

    @property
    def needs_mask(self) -> bool:
        """Whether anything does."""
        return self.draws_mask or (self.paper and not self.targets.no_map)

    @property
    def leaves_out(self) -> bool:
        """Whether the extraction leaves out what is absent or bad."""
        return self.only_complete or self.skip_bad_frames

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values: targets' settings, cameras and compression side by side.

        What is left out is not among them: a shard says itself which frames it lacks.
        """
        targets = dataclasses.asdict(replace(self.targets, max_gap_s=self.targets.gap_s))
        defaults = TargetSettings()
        for name in _LATER:
            if getattr(self.targets, name) == getattr(defaults, name):
                del targets[name]
        for name in ("layers", "classes"):
            if name in targets:
                targets[name] = sorted(targets[name])
        own: dict[str, Any] = {"cameras": sorted(self.cameras), "compression": self.compression}
        if self.definitions != (PAPER,):
            own["definitions"] = sorted(self.definitions, key=NAMES.index)
        values: dict[str, Any] = json.loads(json.dumps(targets | own))
        return values

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`; nothing is left out.

        Raises:
            SettingsError: a value is missing, unknown or out of range.
        """
        try:
            targets = dict(values)
            cameras, compression = tuple(targets.pop("cameras")), targets.pop("compression")
            definitions = tuple(targets.pop("definitions", (PAPER,)))
            targets["grid"] = GridSpec(**targets["grid"])
            for name in {"categories", "layers", "classes"} & targets.keys():
                targets[name] = tuple(targets[name])
            if targets["max_gap_s"] == GAP_STEPS * targets.get("step_s", STEP_S):
                targets["max_gap_s"] = None
            return cls(TargetSettings(**targets), cameras, compression, definitions=definitions)
        except MALFORMED as error:
            raise SettingsError(f"settings can't be read ({error})") from error
