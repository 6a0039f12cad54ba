"""What dataset to synthesize."""

import re
from dataclasses import dataclass
from typing import Literal

from ogmkit.base.stated import require_stated, setting
from ogmkit.errors import SettingsError
from ogmkit.synthetic.rig import CAMERA_MOUNTS, LIDAR

AnnotateBy = Literal["all", "rendered"]


@dataclass(frozen=True)
class SynthesisSettings:
    """What dataset to make.

    Attributes:
        lidar_azimuths: LiDAR rays of a ring.
        images: whether images are rendered; without them the tables name files that aren't there.
        tilt_deg: about how far the body leans, nose down and to the left.
        works_share: share of roadsides where a bay is closed off by barriers and cones.
        odd_areas: whether maps also hold walkways of odd shape: concave ones, and rings that cross or touch
            themselves.

    Raises:
        SettingsError: a setting is out of range or unknown.
    """

    scenes: int = setting(
        4,
        "Number of scenes, spread over four locations.",
        low=1,
        high=9999,  # names have four digits
        flag="--num-scenes",
    )
    frames: int = setting(20, "Number of key frames per scene, half a second apart.", low=1, high=2000)
    seed: int = setting(0, "Random seed.", low=0, high=2**63 - 1)
    version: str = setting("v1.0-mini", "Folder of the tables.", form="NAME")
    cameras: tuple[str, ...] = setting(
        tuple(CAMERA_MOUNTS),
        "Camera channel, such as CAM_FRONT.",
        form="CHANNEL,…",
        flag="--camera --cameras",
        unset="all six",
    )
    image_size: tuple[int, int] = setting(
        (450, 800), "Size of the images.", low=16, high=8192, form="HEIGHTxWIDTH"
    )
    lidar: bool = setting(True, "Make LiDAR sweeps.", flag="--lidar/--no-lidar")
    sweeps: bool = setting(False, "Also make what the sensors record between key frames.")
    relief_m: float = setting(
        0.0,
        "How much the ground's height varies; 0 is a flat world.",
        low=0,
        high=10,
        form="METRES",
        flag="--relief",
    )
    lidar_azimuths: int = 1090
    images: bool = True
    tilt_deg: float = 0.0
    works_share: float = 0.35
    odd_areas: bool = False
    incidents: bool = setting(
        False,
        "Vehicles stand in the ego's lanes, to be passed by swerving, and the car ahead brakes suddenly.",
    )
    scenes_per_log: int = setting(
        2,
        "Maximum number of scenes that are cut from one log; with relief, each log has its sensors mounted a "
        "little differently.",
        low=1,
    )
    annotate_by: AnnotateBy = setting(
        "all",
        "Cameras whose view makes annotations and their visibility, beside the LiDAR: all six, whatever is "
        "rendered, or the rendered ones alone.",
    )

    def __post_init__(self) -> None:
        require_stated(self)
        if re.fullmatch(r"v1\.0-[A-Za-z0-9_-]+", self.version) is None:
            raise SettingsError(f"version: {self.version!r} is not a folder name such as v1.0-mini")
        if not 1 <= self.lidar_azimuths <= 8192:
            raise SettingsError(f"lidar_azimuths: {self.lidar_azimuths} is not between 1 and 8192")
        unknown = [camera for camera in self.cameras if camera not in CAMERA_MOUNTS]
        if unknown or not self.cameras or len(set(self.cameras)) < len(self.cameras):
            raise SettingsError(
                f"cameras: {', '.join(self.cameras) or '(none)'} are not some of "
                f"{', '.join(CAMERA_MOUNTS)}, each once"
            )

    @property
    def annotating(self) -> tuple[str, ...]:
        """Cameras whose view makes annotations and their visibility."""
        return tuple(CAMERA_MOUNTS) if self.annotate_by == "all" else self.cameras

    @property
    def channels(self) -> tuple[str, ...]:
        """Cameras, then the LiDAR."""
        return self.cameras + ((LIDAR,) if self.lidar else ())
