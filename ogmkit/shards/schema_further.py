"""The part of the schema that holds rasters beside the paper's, in each camera's group."""

from collections.abc import Mapping
from dataclasses import replace
from typing import get_args

from ogmkit.nuscenes.expansion import Layer
from ogmkit.shards.fields import COLUMNS, FRAMES, FUTURE, INSTANCES, ROWS, Field, parts_of
from ogmkit.target_settings import TargetSettings

_RASTER = (FRAMES, ROWS, COLUMNS)
_VECTORS = (FRAMES, 2, ROWS, COLUMNS)

LAYER = Field(
    "layers/<layer>",
    "uint8",
    _RASTER,
    "1 where the map's layer covers the cell's centre",
    "",
    "bev",
    "layers",
)
CLASS = Field(
    "classes/<class>",
    "uint8",
    _RASTER,
    "1 where the cell's centre is under a box of the class",
    "",
    "bev",
    "classes",
)
INSTANCE_TOKENS = Field(
    "instances/token",
    "text",
    (INSTANCES,),
    "token of each vehicle, as in boxes/instance_token; ids count them from 1",
    part="instances",
)
FUTURE_VALID = Field(
    "future/valid",
    "bool",
    (FRAMES, FUTURE),
    "whether that key frame is there; the raster is 0 where not",
    part="future",
)
STORED = (
    INSTANCE_TOKENS,
    Field(
        "instances/id",
        "uint16",
        _RASTER,
        "number of the vehicle that the cell's centre is under, the same in all frames; 0 for none",
        "",
        "bev",
        "instances",
    ),
    Field(
        "instances/offset",
        "float32",
        _VECTORS,
        "x, y from the cell's centre to the vehicle's; NaN without one",
        "m",
        "level",
        "flow",
    ),
    Field(
        "instances/flow",
        "float32",
        _VECTORS,
        "x, y that the cell's centre moves with its vehicle until the next key frame; NaN where unknown",
        "m",
        "level",
        "flow",
    ),
    Field(
        "future/vehicles",
        "uint8",
        (FRAMES, FUTURE, ROWS, COLUMNS),
        "1 where the cell's centre is under a vehicle at steps +1 … +n; the grid is this frame's",
        "",
        "bev",
        "future",
    ),
    FUTURE_VALID,
)
FURTHER_FIELDS = (LAYER, CLASS, *STORED)
"""All datasets, of layers and classes one that stands for them."""


def further_fields(settings: TargetSettings) -> tuple[Field, ...]:
    """The datasets of layers and classes, which bear their names."""
    layers = (replace(LAYER, name=f"layers/{name}") for name in settings.layers)
    classes = (
        replace(
            CLASS,
            name=f"classes/{one.name}",
            description=f"{CLASS.description}: {' or '.join(one.parts)} in its category",
        )
        for one in settings.box_classes
    )
    return (*layers, *classes)


def further_rasters(settings: TargetSettings) -> tuple[str, ...]:
    """Names of the rasters that a camera has beside the paper's, such as `layers/lane`."""
    parts = parts_of(settings)
    stored = (field for field in STORED if field.part in parts and field.storage == "rasters")
    return tuple(field.name for field in (*further_fields(settings), *stored))


def named_field(name: str) -> Field | None:
    """The field of a layer or class by its name below a camera's group; None where it is none."""
    kind, _, own = name.partition("/")
    templates: Mapping[str, Field] = {"classes": CLASS} | (
        {"layers": LAYER} if own in get_args(Layer) else {}
    )
    return replace(templates[kind], name=name) if own and kind in templates else None
