"""Settings of a set of footprints."""

from dataclasses import dataclass

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError
from ogmkit.footprints.sets import MaskKind, Method
from ogmkit.homography.sources import SURFACE

_MAX_SIDE_PX = 1 << 14


@dataclass(frozen=True)
class FootprintSettings:
    """What footprints to make.

    Raises:
        SettingsError: the method is unknown, or the scale is not a positive number.
    """

    homography: str = setting(
        SURFACE,
        "Homography that masks are warped with, or one for the drivable area and one for the vehicles, "
        "such as surface+plane; for the other methods, the ground that the drivable area "
        "lies on: surface, calibration or ego-plane.",
        form="SOURCE",
    )
    method: Method = setting(
        "warp",
        "By the homography; exactly, from boxes and ground; or whole bodies, as an ordinary mask has them.",
    )
    scale: float = setting(2.0, "Image size / mask size.", above=0)
    name: str | None = setting(
        None,
        "Name of the set of masks.",
        form="SET",
        flag="--masks",
        unset="SOURCE, SOURCE-project or full-body",
    )

    def __post_init__(self) -> None:
        require_stated(self)

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
