"""The named definitions: the paper's own, the same round the vehicle, and those of the field's repositories.

docs/definitions.md has them side by side, and how far their cells were compared.
"""

import re
from dataclasses import replace

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.labels.definition import Axis, CellRule, Definition, Filters, Grid, LabelClass, without_map
from ogmkit.labels.names import NAMES, PAPER, SURROUND
from ogmkit.target_settings import TargetSettings

REACH_M = 50.0
"""How far the definition `surround` reaches to each side."""
_WORD = r"(^|\.){}(\.|$)"


def _words(*names: str) -> tuple[LabelClass, ...]:
    """Classes by a whole part of the category's name."""
    return tuple(LabelClass(name, _WORD.format(name)) for name in names)


def _layer(name: str, *layers: str) -> LabelClass:
    return LabelClass(name, layers=layers or (name,))


def _square(first_m: float, step_m: float) -> Grid:
    """100 m round the origin in 200 × 200 cells, rows along x, columns along y."""
    return Grid(Axis("x", first_m, step_m, 200), Axis("y", first_m, step_m, 200))


_FORWARD = _square(-49.75, 0.5)
"""Row 0 = 50 m behind, column 0 = 50 m right."""
_BACKWARD = _square(49.75, -0.5)
"""Row 0 = ahead, column 0 = left."""
_ROUNDED = CellRule("outline", index_at=-0.5)

_LSS = Definition(
    "lss",
    1,
    "lidar-ego",
    _FORWARD,
    _ROUNDED,
    (LabelClass("vehicle", r"^vehicle(\.|$)"),),
    source="nv-tlabs/lift-splat-shoot@d74598c",
)
_FIERY = Definition(
    "fiery",
    1,
    "lidar-ego-yaw",
    _FORWARD,
    _ROUNDED,
    (LabelClass("vehicle", "vehicle"),),
    Filters(min_visibility=2),
    ("instance", "visibility"),
    "vehicle",
    source="wayveai/fiery@fd03f16",
)
_STP3 = Definition(
    "stp3",
    1,
    "lidar-ego-yaw",
    _FORWARD,
    _ROUNDED,
    (LabelClass("vehicle", "vehicle"), LabelClass("pedestrian", "human")),
    Filters(min_visibility=2),
    source="OpenDriveLab/ST-P3@6b11e13",
)
_POINTBEV = Definition(
    "pointbev",
    1,
    "lidar-ego-yaw",
    _BACKWARD,
    CellRule("convex-outline", index_at=0.5, drawn="transposed-turned"),
    (LabelClass("vehicle", "vehicle"),),
    beside=("visibility", "valid"),
    beside_categories="vehicle",
    counted="valid",
    source="valeoai/PointBeV@c7eded7",
)
_CVT_VEHICLES = ("car", "truck", "bus", "trailer", "construction", "motorcycle", "bicycle")
_CVT = Definition(
    "cvt",
    1,
    "lidar-ego-yaw-float32",
    _BACKWARD,
    CellRule("outline", index_at=-0.5, layers="whole"),
    (
        *map(_layer, ("lane", "road_segment", "road_divider", "lane_divider")),
        *_words(*_CVT_VEHICLES[:5], "pedestrian", *_CVT_VEHICLES[5:]),
        LabelClass("vehicle", unites=_CVT_VEHICLES),
        LabelClass("road", unites=("lane", "road_segment")),
    ),
    beside=("visibility",),
    beside_categories=_WORD.format("vehicle"),
    counted="visibility-2",
    source="bradyz/cross_view_transformers@4de6e64",
)
_PON_CATEGORIES = {
    "car": r"^vehicle\.car$",
    "truck": r"^vehicle\.truck$",
    "bus": r"^vehicle\.bus\.(bendy|rigid)$",
    "trailer": r"^vehicle\.trailer$",
    "construction_vehicle": r"^vehicle\.construction$",
    "pedestrian": r"^human\.pedestrian\.(adult|child|construction_worker|police_officer)$",
    "motorcycle": r"^vehicle\.motorcycle$",
    "bicycle": r"^vehicle\.bicycle$",
    "traffic_cone": r"^movable_object\.trafficcone$",
    "barrier": r"^movable_object\.barrier$",
}
_PON = Definition(
    "pon",
    1,
    "camera",
    Grid(Axis("z", 1.125, 0.25, 196), Axis("x", -24.875, 0.25, 200)),
    CellRule("convex-outline", index_at=-0.5, layers="cut-convex"),
    (
        *map(_layer, ("drivable_area", "ped_crossing", "walkway")),
        _layer("carpark", "carpark_area"),
        *(LabelClass(name, categories) for name, categories in _PON_CATEGORIES.items()),
    ),
    beside=("ignore",),
    occlusion="image-and-lidar-rays",
    counted="not-ignored",
    split="pon",
    source="tom-roddick/mono-semantic-maps@f6b0f52",
)
_BEVFUSION = Definition(
    "bevfusion",
    1,
    "lidar-heading",
    _FORWARD,
    CellRule("outline", index_at=-0.5, drawn="transposed", layers="cut"),
    (
        *map(_layer, ("drivable_area", "ped_crossing", "walkway", "stop_line", "carpark_area")),
        _layer("divider", "road_divider", "lane_divider"),
    ),
    metric="iou-pooled-best-threshold",
    source="mit-han-lab/bevfusion@326653d",
)

PRESETS: dict[str, Definition] = {
    one.name: one for one in (_LSS, _FIERY, _CVT, _PON, _BEVFUSION, _POINTBEV, _STP3)
}
"""Name → what that repository's own code draws."""


def definition(name: str, targets: TargetSettings | None = None) -> Definition:
    """The definition of a name.

    Args:
        name: one of `NAMES`.
        targets: what ogmkit's own are made with; the defaults where None.

    Raises:
        SettingsError: there is no such name.
    """
    own = {PAPER: paper, SURROUND: surround}
    if name in own:
        return own[name](TargetSettings() if targets is None else targets)
    if name not in PRESETS:
        raise SettingsError(unknown("definition", name, NAMES))
    return PRESETS[name]


def drawable(name: str, *, no_map: bool = False) -> Definition:
    """The definition of a name as far as `labels_of` draws it.

    Args:
        name: one of `NAMES`; of ogmkit's own, vehicles alone, since their drivable area is the map mask's.
        no_map: leave out all classes that need a map.

    Raises:
        SettingsError: there is no such name.
    """
    found = definition(name, TargetSettings(no_map=True))
    return without_map(found) if no_map else found


def paper(targets: TargetSettings) -> Definition:
    """The paper's labels, as the settings of an extraction make them."""
    beginnings = "|".join(re.escape(name) for name in targets.categories)
    drivable = () if targets.no_map else (_layer("drivable", "drivable_area"),)
    return Definition(
        PAPER,
        1,
        "image-level",
        _paper_grid(targets.grid),
        CellRule("centre", layers="none" if targets.no_map else "mask"),
        (*drivable, LabelClass("vehicles", f"^({beginnings})")),
        Filters(min_visibility=targets.min_visibility, min_lidar_points=targets.min_lidar_points),
        occlusion="field-of-view",
        split="by-folder",
    )


def surround(targets: TargetSettings) -> Definition:
    """The paper's labels round the vehicle: a square of the grid's cells, in the sample's level frame."""
    m_per_cell = targets.grid.m_per_cell
    cells = 2 * max(1, round(REACH_M / m_per_cell))
    grid = GridSpec(m_per_cell, cells, cells, cells / 2, cells / 2)
    same = paper(targets)
    return replace(same, name=SURROUND, frame="lidar-level", grid=_paper_grid(grid), occlusion="none")


def _paper_grid(grid: GridSpec) -> Grid:
    m, half = grid.m_per_cell, 0.5
    return Grid(
        Axis("x", m * (grid.ego_row - half), -m, grid.rows),
        Axis("y", m * (grid.ego_column - half), -m, grid.columns),
    )
