"""What a shard holds: the one table from which writer, reader, verifier and documentation come."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import h5py
import numpy as np

FORMAT = "ogmkit-shard"
FORMAT_VERSION = 1

Part = Literal["core", "image", "lidar"]
Storage = Literal["whole", "rasters", "bytes", "rows"]
Dimension = str | int

FRAMES, FRAMES_AND_END, BOXES, POINTS = "N", "N + 1", "M", "P"
ROWS, COLUMNS = "rows", "columns"


@dataclass(frozen=True)
class Field:
    """One dataset of a camera's group.

    Attributes:
        name: below the camera's group, such as `boxes/size_wlh`.
        dtype: a numpy name, `text` (UTF-8) or `bytes` (a variable number of uint8 a row).
        shape: sizes, or symbols: N frames, M boxes, P points, rows, columns.
        description: what a row means.
        units: of the values; empty where they have none.
        frame: coordinate frame of the values; empty where they have none.
        part: stored always (`core`), or only where the settings ask for it.
    """

    name: str
    dtype: str
    shape: tuple[Dimension, ...]
    description: str
    units: str = ""
    frame: str = ""
    part: Part = "core"

    @property
    def storage(self) -> Storage:
        """How it is laid out: at once, a compressed chunk a frame, bytes a frame, or appended rows."""
        if self.dtype == "bytes":
            return "bytes"
        if self.shape[0] == POINTS:
            return "rows"
        return "rasters" if self.shape[1:] == (ROWS, COLUMNS) else "whole"

    @property
    def h5_dtype(self) -> np.dtype[Any]:
        """The dtype that h5py stores."""
        special: dict[str, np.dtype[Any]] = {"text": h5py.string_dtype(), "bytes": h5py.vlen_dtype(np.uint8)}
        return special[self.dtype] if self.dtype in special else np.dtype(self.dtype)

    @property
    def memory_dtype(self) -> np.dtype[Any]:
        """The dtype of its values as numpy holds them: text and bytes are objects."""
        return np.dtype(object if self.dtype in ("text", "bytes") else self.dtype)

    def resolved(self, sizes: dict[str, int]) -> tuple[int, ...]:
        """The shape with its symbols replaced."""
        return tuple(sizes[size] if isinstance(size, str) else size for size in self.shape)


@dataclass(frozen=True)
class Attribute:
    """One attribute of the file or of a camera's group."""

    name: str
    kind: type[str] | type[int] | type[float]
    description: str


FILE_ATTRIBUTES = (
    Attribute("format", str, f"`{FORMAT}`"),
    Attribute("format_version", int, f"{FORMAT_VERSION}; readers refuse any other"),
    Attribute("package_version", str, "ogmkit's version that wrote the shard"),
    Attribute("dataset_version", str, "the source's tables, such as `v1.0-trainval`"),
    Attribute("scene", str, "scene name"),
    Attribute("location", str, "map name"),
    Attribute("settings", str, "all settings of the run, as JSON"),
    Attribute("grid_m_per_cell", float, "side of a cell in metres"),
    Attribute("grid_rows", int, "rows of every raster"),
    Attribute("grid_columns", int, "columns of every raster"),
    Attribute("grid_ego_row", float, "the ego's place, in cells from the grid's top edge"),
    Attribute("grid_ego_column", float, "the ego's place, in cells from the grid's left edge"),
)

CAMERA_ATTRIBUTES = (
    Attribute("channel", str, "camera channel, the group's name"),
    Attribute("valid_trajectories", int, "frames whose trajectory is valid"),
    Attribute("drivable_share", float, "share of drivable cells over all frames"),
    Attribute("vehicle_share", float, "share of vehicle cells over all frames"),
)

DATASET_ATTRIBUTES = ("description", "units", "frame")

_RASTER = (FRAMES, ROWS, COLUMNS)
_POSE = (FRAMES, 4, 4)
_PATH = (FRAMES, 6, 2)
_STEPS = (FRAMES, 6)

FIELDS = (
    Field("sample_token", "text", (FRAMES,), "token of the key frame; frames stand in temporal order"),
    Field("sample_data_token", "text", (FRAMES,), "token of the camera's image"),
    Field("timestamp_us", "int64", (FRAMES,), "the image's own time", "us"),
    Field("drivable", "uint8", _RASTER, "1 where the cell's centre is on the map's drivable area", "", "bev"),
    Field("vehicles", "uint8", _RASTER, "1 where the cell's centre is under a vehicle", "", "bev"),
    Field(
        "field_of_view",
        "uint8",
        _RASTER,
        "1 where the camera sees the cell's centre, by calibration",
        "",
        "bev",
    ),
    Field("image", "bytes", (FRAMES,), "the original JPEG file", "", "image", "image"),
    Field("image_path", "text", (FRAMES,), "the JPEG's path below the dataset's root"),
    Field("image_size", "int64", (FRAMES, 2), "height, width", "px", "image"),
    Field(
        "intrinsics",
        "float64",
        (FRAMES, 3, 3),
        "pinhole matrix; pixel centres are integers",
        "px",
        "camera",
    ),
    Field("ego_from_camera", "float64", _POSE, "mounting of the camera", "m", "ego"),
    Field("global_from_ego", "float64", _POSE, "ego pose of the image", "m", "global"),
    Field("level_from_global", "float64", _POSE, "into the level frame of the ego pose", "m", "level"),
    Field("trajectory/past", "float64", _PATH, "x, y at steps −6 … −1; NaN where missing", "m", "level"),
    Field("trajectory/past_valid", "bool", _STEPS, "whether the past position is there"),
    Field("trajectory/future", "float64", _PATH, "x, y at steps +1 … +6; NaN where missing", "m", "level"),
    Field("trajectory/future_valid", "bool", _STEPS, "whether the future position is there"),
    Field("trajectory/valid", "bool", (FRAMES,), "whether all twelve positions are there"),
    Field("boxes/offsets", "int64", (FRAMES_AND_END,), "frame i owns rows offsets[i] … offsets[i + 1] − 1"),
    Field("boxes/annotation_token", "text", (BOXES,), "token of the annotation"),
    Field("boxes/instance_token", "text", (BOXES,), "token of the object, the same over time"),
    Field("boxes/category", "text", (BOXES,), "full category name, such as `vehicle.car`"),
    Field(
        "boxes/global_from_box",
        "float64",
        (BOXES, 4, 4),
        "pose of the centre, x to the front",
        "m",
        "global",
    ),
    Field("boxes/size_wlh", "float64", (BOXES, 3), "width, length, height", "m"),
    Field("boxes/visibility", "uint8", (BOXES,), "nuScenes level 1 to 4; 0 = unknown"),
    Field("boxes/num_lidar_pts", "int64", (BOXES,), "LiDAR points in the box"),
    Field(
        "lidar/points",
        "float32",
        (POINTS, 4),
        "x, y, z at the image's time; intensity",
        "m",
        "level",
        "lidar",
    ),
    Field(
        "lidar/offsets",
        "int64",
        (FRAMES_AND_END,),
        "frame i owns points offsets[i] … offsets[i + 1] − 1",
        part="lidar",
    ),
)
"""All datasets of a camera's group."""


def fields(*, image: bool, lidar: bool) -> tuple[Field, ...]:
    """The datasets that a shard holds with these settings."""
    parts = {"core"} | ({"image"} if image else set()) | ({"lidar"} if lidar else set())
    return tuple(field for field in FIELDS if field.part in parts)


def markdown() -> str:
    """The schema as Markdown tables: datasets of a camera's group, then attributes."""
    return "\n".join(_dataset_lines()) + "\n\n" + "\n".join(_attribute_lines()) + "\n"


def _dataset_lines() -> Iterator[str]:
    yield "| `/<CAMERA>/…` | dtype | shape | meaning | units | frame |"
    yield "| --- | --- | --- | --- | --- | --- |"
    when = {"core": "", "image": " (with `--images bytes`)", "lidar": " (with `--lidar`)"}
    for field in FIELDS:
        shape = ", ".join(str(size) for size in field.shape)
        meaning = field.description + when[field.part]
        yield f"| `{field.name}` | {field.dtype} | ({shape}) | {meaning} | {field.units} | {field.frame} |"


def _attribute_lines() -> Iterator[str]:
    yield "| attribute of | name | type | meaning |"
    yield "| --- | --- | --- | --- |"
    for owner, attributes in (("file", FILE_ATTRIBUTES), ("`/<CAMERA>`", CAMERA_ATTRIBUTES)):
        for attribute in attributes:
            name, kind = attribute.name, attribute.kind.__name__
            yield f"| {owner} | `{name}` | {kind} | {attribute.description} |"
