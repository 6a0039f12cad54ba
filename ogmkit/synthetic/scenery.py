"""What the synthetic sensors look at: the ground and the boxes that stand on it.

All coordinates are in `global`, metres.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.synthetic.ground import GroundLayers, HeightFunction
from ogmkit.synthetic.ground_texture import LONGEST_M, GroundTexture, draw_texture
from ogmkit.synthetic.palette import Palette
from ogmkit.typing import BoolArray, FloatArray

__all__ = [
    "BUILDING",
    "TREE",
    "GroundLayers",
    "HeightFunction",
    "Palette",
    "Scenery",
    "Solids",
    "concatenate",
]

BUILDING = "building"
"""Category of a building: a box with a facade, never annotated."""
TREE = "tree"
"""Category of a tree: its box is drawn as a trunk and a crown, never annotated."""


@dataclass(frozen=True, eq=False)
class Solids:
    """Boxes that cameras and LiDAR see at one moment; M of them.

    Attributes:
        global_from_box: (M, 4, 4) poses; the origin is the box's centre, x forward, y left, z up.
        size_wlh: (M, 3) width (y), length (x), height (z) in metres.
        category: M names: nuScenes categories, `BUILDING` or `TREE`; they choose look and reflectance.
        colour_bgr: (M, 3) paint in full light: blue, green, red from 0 to 255.
        annotated: (M,) whether the dataset's tables list the box.

    Raises:
        SettingsError: the shapes disagree.
    """

    global_from_box: FloatArray
    size_wlh: FloatArray
    category: tuple[str, ...]
    colour_bgr: FloatArray
    annotated: BoolArray

    def __post_init__(self) -> None:
        count = len(self.category)
        shapes = [
            self.global_from_box.shape,
            self.size_wlh.shape,
            self.colour_bgr.shape,
            self.annotated.shape,
        ]
        if shapes != [(count, 4, 4), (count, 3), (count, 3), (count,)]:
            raise SettingsError(f"solids: {count} categories, but arrays of shapes {shapes}")

    def __len__(self) -> int:
        return len(self.category)


def concatenate(parts: Sequence[Solids]) -> Solids:
    """All boxes of several collections, in their order."""
    return Solids(
        global_from_box=np.concatenate([np.zeros((0, 4, 4)), *(part.global_from_box for part in parts)]),
        size_wlh=np.concatenate([np.zeros((0, 3)), *(part.size_wlh for part in parts)]),
        category=tuple(name for part in parts for name in part.category),
        colour_bgr=np.concatenate([np.zeros((0, 3)), *(part.colour_bgr for part in parts)]),
        annotated=np.concatenate([np.zeros(0, dtype=np.bool_), *(part.annotated for part in parts)]),
    )


@dataclass(frozen=True, eq=False)
class Scenery:
    """The ground of a scene and its light.

    Attributes:
        layers: what is painted on the ground.
        height: the ground's height, or None for a world that is flat at z = 0 (faster, and exact).
        palette: light and colours.
        extent: x_min, y_min, x_max, y_max of the ground that is textured; its rim is continued beyond. Some
            120 m around the drive are enough; memory and time grow with the area.

    Raises:
        SettingsError: the extent is empty, or too long for its raster.
    """

    layers: GroundLayers
    height: HeightFunction | None
    palette: Palette
    extent: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        x_min, y_min, x_max, y_max = self.extent
        if not (x_min < x_max and y_min < y_max):
            raise SettingsError(f"scenery: extent {self.extent} is empty; give x_min, y_min, x_max, y_max")
        if max(x_max - x_min, y_max - y_min) > LONGEST_M:
            raise SettingsError(f"scenery: extent {self.extent} is longer than {LONGEST_M:.0f} m; cut it")

    @cached_property
    def texture(self) -> GroundTexture:
        """The painted ground, drawn on first use and kept."""
        return draw_texture(self.layers, self.palette, self.extent, self.height)
