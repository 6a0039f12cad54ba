"""What a label means, as a record: two scores can be compared where their records are equal."""

import dataclasses
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ogmkit.base.differences import differences
from ogmkit.typing import FloatArray

Frame = Literal[
    "image-level",
    "lidar-level",
    "lidar-ego",
    "lidar-ego-yaw",
    "lidar-ego-yaw-float32",
    "lidar-heading",
    "camera",
]
"""Whose plane the cells lie on; `plane` says how each is found."""
Fill = Literal["centre", "outline", "convex-outline"]
"""Cells whose centre is inside; inside and the rounded outline; the same by a convex polygon's rule."""
Drawn = Literal["as-stored", "transposed", "transposed-turned"]
"""How the array lies to the picture that polygons are drawn in: a rule's ties depend on directions."""
LayerRule = Literal["none", "mask", "whole", "cut", "cut-convex"]
"""How map layers are drawn; `layers` says how each does it."""
Beside = Literal["instance", "visibility", "valid", "ignore"]
"""Arrays that are no class."""
Counted = Literal["all", "visibility-2", "valid", "not-ignored"]
"""Cells that the score counts."""


@dataclass(frozen=True)
class Axis:
    """One axis of a label's array.

    Attributes:
        coordinate: of the frame's plane that grows along it.
        first_m: centre of the first nominal cell.
        step_m: from a cell's centre to the next; negative where the coordinate falls.
        cells: how many.
    """

    coordinate: Literal["x", "y", "z"]
    first_m: float
    step_m: float
    cells: int

    @property
    def centres_m(self) -> FloatArray:
        """(cells,) coordinates of the nominal cells' centres."""
        result: FloatArray = self.first_m + self.step_m * np.arange(self.cells, dtype=np.float64)
        return result


@dataclass(frozen=True)
class Grid:
    """A label's array on the frame's plane.

    Attributes:
        rows: its first axis.
        columns: its second.
    """

    rows: Axis
    columns: Axis

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows.cells, self.columns.cells


@dataclass(frozen=True)
class CellRule:
    """From metres to cells.

    Attributes:
        fill: which cells a polygon covers.
        index_at: where the point that an index stands for lies from the nominal cell's centre, in cells along
            the axes: vertices are rounded to such points.
        drawn: how the array lies to the picture that is drawn in.
        layers: how map layers are drawn.
    """

    fill: Fill
    index_at: float = 0.0
    drawn: Drawn = "as-stored"
    layers: LayerRule = "none"


@dataclass(frozen=True)
class LabelClass:
    """One class; of the three, one says what it is made of.

    Attributes:
        name: its dataset's.
        categories: regular expression that is looked for in a category's name. The first class where it is
            found takes the box.
        layers: of the map.
        unites: other classes.
    """

    name: str
    categories: str = ""
    layers: tuple[str, ...] = ()
    unites: tuple[str, ...] = ()


@dataclass(frozen=True)
class Filters:
    """Which boxes classes show.

    Attributes:
        min_visibility: lowest visibility level, 0 to 4.
        unknown_visibility: the level that an unknown one counts as.
        min_lidar_points: fewest LiDAR points in a box.
    """

    min_visibility: int = 0
    unknown_visibility: int = 4
    min_lidar_points: int = 0


@dataclass(frozen=True)
class Definition:
    """A named label.

    Attributes:
        name: such as `lss`.
        version: counts changes of what the name stands for.
        frame: whose plane.
        grid: the array.
        cell: from metres to cells.
        classes: in the order of the array.
        filters: of boxes.
        beside: arrays that lie beside the classes.
        beside_categories: regular expression of the boxes that `instance` and `visibility` draw.
        occlusion: how cells are found that aren't seen.
        time: of the annotations.
        split: that scores are published on.
        counted: cells that the score counts.
        metric: how the score is taken over the frames.
        source: the repository and commit that it is the rule of; empty for ogmkit's own.
    """

    name: str
    version: int
    frame: Frame
    grid: Grid
    cell: CellRule
    classes: tuple[LabelClass, ...]
    filters: Filters = Filters()
    beside: tuple[Beside, ...] = ()
    beside_categories: str = ""
    occlusion: Literal["none", "field-of-view", "image-and-lidar-rays"] = "none"
    time: Literal["sample", "image"] = "sample"
    split: str = "nuscenes-official"
    counted: Counted = "all"
    metric: str = "iou-pooled"
    source: str = ""

    @property
    def class_names(self) -> tuple[str, ...]:
        """In the order of the array."""
        return tuple(one.name for one in self.classes)

    @property
    def arrays(self) -> tuple[str, ...]:
        """Names of all arrays of a frame: classes, then what lies beside."""
        return (*self.class_names, *self.beside)

    @property
    def layers(self) -> tuple[str, ...]:
        """Map layers that it is made from."""
        return tuple(layer for one in self.classes for layer in one.layers)

    @property
    def needs_map(self) -> bool:
        """Whether it can't be made without a map."""
        return bool(self.layers)

    @property
    def place(self) -> Literal["SURROUND", "CAM_FRONT"]:
        """The group of a shard that it is stored below."""
        return "CAM_FRONT" if self.frame == "camera" else "SURROUND"

    def class_of(self, category: str) -> str | None:
        """The class that shows a category's boxes; None where none does."""
        boxes = (one for one in self.classes if one.categories)
        return next((one.name for one in boxes if re.search(one.categories, category)), None)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values, as they are stored."""
        values: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(self)))
        return values


def without_map(definition: Definition) -> Definition:
    """The definition without classes that need a map."""
    kept = tuple(one for one in definition.classes if not one.layers)
    names = {one.name for one in kept}
    kept = tuple(one for one in kept if set(one.unites) <= names)
    cell = dataclasses.replace(definition.cell, layers="none")
    return dataclasses.replace(definition, classes=kept, cell=cell)


def differing_fields(here: Mapping[str, Any], there: Mapping[str, Any]) -> tuple[str, ...]:
    """The fields in which two stored definitions differ, each with both values; none where scores compare.

    Args:
        here: of `Definition.to_dict`.
        there: the other's.
    """
    return differences(_by_class(here), _by_class(there))


def _by_class(values: Mapping[str, Any]) -> dict[str, Any]:
    """With a class's fields under its name, so that a difference names the class."""
    classes = {one["name"]: {**one, "place": i} for i, one in enumerate(values["classes"])}
    return {**values, "classes": classes}
