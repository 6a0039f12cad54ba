"""What contact sheets show."""

from dataclasses import dataclass
from typing import Literal

from ogmkit.base.stated import require_stated, setting
from ogmkit.drawing.palette import ThemeName
from ogmkit.homography.sources import SURFACE

View = Literal["targets", "footprints", "stretch", "masks", "layers", "surround"]
"""Names of `ogmkit.pictures.subjects.SUBJECTS`, and the one that shows all cameras at once."""


@dataclass(frozen=True)
class PreviewSettings:
    """What contact sheets show; a sheet for each scene, camera and view.

    Raises:
        SettingsError: a view or theme is unknown, or the number of frames out of range.
    """

    views: tuple[View, ...] = setting(
        ("targets",), "What to draw, as listed above.", form="VIEW,…", flag="--view"
    )
    masks: str = setting(
        SURFACE, "Set of camera-view masks to draw in views that show one.", form="SET", flag="--masks"
    )
    frames: int = setting(  # 60 are about 300 MB of pixels
        6, "Number of frames on a sheet, evenly spread over the scene.", low=1, high=60
    )
    theme: ThemeName = setting("dark", "Colours: dark for screens, light for paper.")

    def __post_init__(self) -> None:
        require_stated(self)
