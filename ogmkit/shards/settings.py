"""Settings of an extraction: what every shard of a folder has in common."""

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

from ogmkit.base.stated import require_stated, setting
from ogmkit.base.steps import GAP_STEPS, STEP_S
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.target_settings import TargetSettings

Compression = Literal["gzip", "lzf", "none"]
"""Of the rasters and LiDAR points. All are part of plain HDF5 but `lzf`, which h5py brings."""


@dataclass(frozen=True)
class ExtractSettings:
    """What to extract, and how it is stored.

    Attributes:
        targets: what targets to make.

    Raises:
        SettingsError: no camera, one named twice, or an unknown compression.
    """

    targets: TargetSettings = field(default_factory=TargetSettings)
    cameras: tuple[str, ...] = setting(
        ("CAM_FRONT",), "Camera channel, such as CAM_FRONT.", form="CHANNEL,…", flag="--camera"
    )
    compression: Compression = setting("gzip", "Of rasters and points; lzf needs h5py to be read.")

    def __post_init__(self) -> None:
        require_stated(self)
        if not self.cameras or len(set(self.cameras)) != len(self.cameras):
            raise SettingsError(f"cameras: {', '.join(self.cameras) or 'none'}: name at least one, each once")

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values: targets' settings, cameras and compression side by side.

        The step is left out where it is 0.5 s, as shards have it that were written before it could be set.
        """
        targets = dataclasses.asdict(replace(self.targets, max_gap_s=self.targets.gap_s))
        if self.targets.step_s == STEP_S:
            del targets["step_s"]
        own = {"cameras": sorted(self.cameras), "compression": self.compression}
        values: dict[str, Any] = json.loads(json.dumps(targets | own))
        return values

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`.

        Raises:
            SettingsError: a value is missing, unknown or out of range.
        """
        try:
            targets = dict(values)
            cameras, compression = tuple(targets.pop("cameras")), targets.pop("compression")
            targets["grid"] = GridSpec(**targets["grid"])
            targets["categories"] = tuple(targets["categories"])
            step_s = targets.setdefault("step_s", STEP_S)
            if targets["max_gap_s"] == GAP_STEPS * step_s:
                targets["max_gap_s"] = None
            return cls(TargetSettings(**targets), cameras, compression)
        except (KeyError, TypeError, ValueError) as error:
            raise SettingsError(f"settings can't be read ({error})") from error
