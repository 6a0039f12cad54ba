"""Settings of a set of footprints."""

import math
from dataclasses import dataclass
from typing import get_args

from ogmkit.errors import SettingsError
from ogmkit.footprints.sets import MaskKind, Method
from ogmkit.homography.sources import SURFACE

_MAX_SIDE_PX = 1 << 14


@dataclass(frozen=True)
class FootprintSettings:
    """What footprints to make.

    Attributes:
        homography: the source that BEV masks are warped with. For `project` and `full-body` it names the
            ground that the drivable area lies on.
        method: how they are made.
        scale: image size / mask size.
        name: of the set; None is the source's name, `<source>-project` or `full-body`.

    Raises:
        SettingsError: the method is unknown, or the scale is not a positive number.
    """

    homography: str = SURFACE
    method: Method = "warp"
    scale: float = 2.0
    name: str | None = None

    def __post_init__(self) -> None:
        if self.method not in get_args(Method):
            known = ", ".join(get_args(Method))
            raise SettingsError(f"footprint method {self.method!r} is unknown: choose from {known}")
        if not (math.isfinite(self.scale) and self.scale > 0):
            raise SettingsError(f"scale: {self.scale:g} is not a positive number")

    @property
    def set_name(self) -> str:
        """The name that the set is stored by."""
        return MaskKind(self.method, self.homography).name if self.name is None else self.name

    def mask_size(self, image_size: tuple[int, int]) -> tuple[int, int]:
        """(height, width) of the masks of images of that size, rounded to whole pixels.

        Raises:
            SettingsError: nothing is left of the image, or the masks would be too large.
        """
        height, width = (round(side / self.scale) for side in image_size)
        if min(height, width) < 1:
            raise SettingsError(f"scale: {self.scale:g} leaves nothing of {_shown(image_size)} pixels")
        if max(height, width) > _MAX_SIDE_PX:
            raise SettingsError(f"scale: {self.scale:g} makes masks of {height} × {width} pixels")
        return height, width


def _shown(image_size: tuple[int, int]) -> str:
    return f"{image_size[0]} × {image_size[1]}"
