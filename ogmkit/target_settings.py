"""What targets to make of a frame."""

from dataclasses import dataclass, field
from typing import Literal, get_args

from ogmkit.base.stated import require_stated, setting, with_default
from ogmkit.base.steps import GAP_STEPS, STEP_S, STEPS
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.homography.settings import FitSettings
from ogmkit.nuscenes.categories import BoxClass, box_class
from ogmkit.nuscenes.expansion import Layer

Seen = Literal["fov", "rays", "lidar"]
"""How cells are found that are seen; the first always is."""
ImagesMode = Literal["bytes", "reference", "none"]
"""Keep each image's own bytes, only its path (the file is checked all the same), or the path unchecked."""


@dataclass(frozen=True)
class TargetSettings:
    """What targets to make (docs/design.md §3).

    Attributes:
        grid: the bird's-eye-view grid.

    Raises:
        SettingsError: a setting is out of range or unknown.
    """

    grid: GridSpec = field(default_factory=GridSpec)
    categories: tuple[str, ...] = with_default(FitSettings, "categories", ("vehicle.",))
    min_visibility: int = with_default(FitSettings, "min_visibility", 0)
    min_lidar_points: int = with_default(FitSettings, "min_lidar_points", 0)
    step_s: float = setting(
        STEP_S,
        "Time from one point of a trajectory, or image of a sequence, to the next.",
        above=0,
        form="SECONDS",
        flag="--step",
    )
    max_gap_s: float | None = setting(
        None,
        "Maximum time between two of them.",
        above=0,
        form="SECONDS",
        flag="--max-gap",
        unset=f"{GAP_STEPS:g} × the step",
    )
    images: ImagesMode = setting(
        "bytes", "Keep each image file itself, or only its path (none: the file may be absent)."
    )
    lidar: bool = setting(False, "Also keep the LiDAR points, moved to the image's time.")
    lidar_channel: str = setting("LIDAR_TOP", "The LiDAR whose points these are.", form="CHANNEL")

    no_map: bool = setting(False, "Leave the drivable area out: no map mask is needed.")
    layers: tuple[Layer, ...] = setting(
        (), "Layers of the map expansion (v1.3) to draw.", form="NAME,…", unset="none"
    )
    line_width_m: float | None = setting(
        None, "Width of lines among them.", above=0, form="METRES", flag="--line-width", unset="2 cells"
    )
    classes: tuple[str, ...] = setting(
        (),
        "Classes of boxes to draw, each by itself: a part of category names between dots, such as car, or "
        "NAME=PART+PART.",
        form="NAME,…",
        unset="none",
    )
    instances: bool = setting(False, "Draw vehicles with their numbers, which are the same over time.")
    flow: bool = setting(
        False,
        "Beside them, draw where cells' vehicles have their centre, and how cells move to the next frame.",
    )
    future: int = setting(
        0, "Draw vehicles of so many next key frames, on this one's grid.", low=0, high=STEPS
    )
    seen: tuple[Seen, ...] = setting(
        ("fov",),
        "Masks of cells that are seen: fov, the field of view, is always made; of its cells, rays has those "
        "that no box hides, lidar those as far as LiDAR points.",
        form="KIND,…",
    )

    def __post_init__(self) -> None:
        require_stated(self)
        in_order = tuple(kind for kind in get_args(Seen) if kind == "fov" or kind in self.seen)
        object.__setattr__(self, "seen", in_order)
        if not self.categories or not all(self.categories):
            raise SettingsError("categories: name at least one prefix, such as vehicle.")
        for what, names in {
            "layers": self.layers,
            "classes": tuple(one.name for one in self.box_classes),
        }.items():
            if len(set(names)) != len(names):
                raise SettingsError(f"{what}: {', '.join(names)}: name each once")
        if self.flow and not self.instances:
            raise SettingsError("flow: is of instances; ask for them too (--instances)")

    @property
    def labels(self) -> tuple[tuple[str, ...], int, int]:
        """Which boxes count as vehicles, as `ogmkit.raster.vehicles.select` takes it."""
        return self.categories, self.min_visibility, self.min_lidar_points

    @property
    def box_classes(self) -> tuple[BoxClass, ...]:
        """The classes that have a raster of their own."""
        return tuple(map(box_class, self.classes))

    @property
    def line_m(self) -> float:
        """Width of lines, metres: by default they are whole at any heading."""
        return 2 * self.grid.m_per_cell if self.line_width_m is None else self.line_width_m

    @property
    def following(self) -> int:
        """How many key frames after a frame its rasters need."""
        return max(self.future, int(self.flow))

    @property
    def further(self) -> bool:
        """Whether anything beside the paper's targets is wanted."""
        return bool(self.layers or self.classes or self.instances or self.future)

    @property
    def lidar_source(self) -> str | None:
        """The channel of the LiDAR that is read; None where no points are needed."""
        return self.lidar_channel if self.lidar or "lidar" in self.seen else None

    @property
    def gap_s(self) -> float:
        """Maximum time between two neighbours, seconds."""
        return GAP_STEPS * self.step_s if self.max_gap_s is None else self.max_gap_s
