"""What a shard holds: the one table from which writer, reader, verifier and documentation come."""

from collections.abc import Collection

from ogmkit.shards.fields import (
    BOXES,
    COLUMNS,
    FRAMES,
    FRAMES_AND_END,
    HEIGHT,
    LEFT_OUT,
    POINTS,
    ROWS,
    WIDTH,
    AddedKind,
    Attribute,
    Field,
    Part,
)
from ogmkit.shards.schema_further import STORED, named_field
from ogmkit.shards.schema_labels import LABELS, POSES, label_field
from ogmkit.shards.schema_seen import SEEN_FIELDS

FORMAT = "ogmkit-shard"
FORMAT_VERSION = 1

FILE_ATTRIBUTES = (
    Attribute("format", str, f"`{FORMAT}`"),
    Attribute("format_version", int, f"{FORMAT_VERSION}; readers refuse any other"),
    Attribute("package_version", str, "ogmkit's version that wrote the shard"),
    Attribute("dataset_version", str, "the source's tables, such as `v1.0-trainval`"),
    Attribute("scene", str, "scene name"),
    Attribute("location", str, "map name"),
    Attribute("log", str, "token of the drive that the scene is cut from", "optional"),
    Attribute("settings", str, "all settings of the run, as JSON"),
    Attribute("grid_m_per_cell", float, "side of a cell in metres"),
    Attribute("grid_rows", int, "rows of every raster"),
    Attribute("grid_columns", int, "columns of every raster"),
    Attribute("grid_ego_row", float, "the ego's place, in cells from the grid's top edge"),
    Attribute("grid_ego_column", float, "the ego's place, in cells from the grid's left edge"),
    Attribute("no_map", int, "1: nothing here knows the drivable area", "no map"),
)

CAMERA_ATTRIBUTES = (
    Attribute("channel", str, "camera channel, the group's name"),
    Attribute("valid_trajectories", int, "frames whose trajectory is valid"),
    Attribute("drivable_share", float, "share of drivable cells over all frames", "map"),
    Attribute("vehicle_share", float, "share of vehicle cells over all frames"),
    Attribute("field_of_view_share", float, "share of cells in view over all frames", "optional"),
    Attribute(
        "step_s", float, "median time in s from a frame to the one a step on; NaN without any", "optional"
    ),
    Attribute("step_min_s", float, "the shortest such time", "optional"),
    Attribute("step_max_s", float, "the longest such time", "optional"),
    Attribute("frames_left_out", int, "L, frames whose file was absent or bad", "left out"),
    Attribute("definition", str, "record of the labels' definition, as JSON", "optional"),
)

DATASET_ATTRIBUTES = ("description", "units", "frame")

_RASTER, _POSE = (FRAMES, ROWS, COLUMNS), (FRAMES, 4, 4)
_PATH, _STEPS = (FRAMES, 6, 2), (FRAMES, 6)

FIELDS = (
    Field("sample_token", "text", (FRAMES,), "token of the key frame; frames stand in temporal order"),
    Field("sample_data_token", "text", (FRAMES,), "token of the camera's image"),
    Field("timestamp_us", "int64", (FRAMES,), "the image's own time", "us"),
    Field(
        "drivable",
        "uint8",
        _RASTER,
        "1 where the cell's centre is on the map's drivable area",
        frame="bev",
        part="map",
    ),
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
        "intrinsics", "float64", (FRAMES, 3, 3), "pinhole matrix; pixel centres are integers", "px", "camera"
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
        "boxes/global_from_box", "float64", (BOXES, 4, 4), "pose of the centre, x to the front", "m", "global"
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
    *SEEN_FIELDS,
)
"""All datasets of a camera's group but those of added groups, and of frames that are left out."""

LEFT_OUT_FIELDS = (
    Field(
        "left_out/sample_data_token",
        "text",
        (LEFT_OUT,),
        "token of the image of a frame that is not here, in temporal order",
        part="left out",
    ),
    Field("left_out/timestamp_us", "int64", (LEFT_OUT,), "its time", "us", part="left out"),
    Field("left_out/reason", "text", (LEFT_OUT,), "what was wrong with its file", part="left out"),
)
"""Datasets of a camera's group that has lost frames: neighbours in time are looked for among these too."""

_OF_CAMERAS = (*FIELDS, *LEFT_OUT_FIELDS, *STORED)

HOMOGRAPHY = AddedKind(
    "homography",
    "source",
    (
        Field(
            "bev_from_image",
            "float64",
            (FRAMES, 3, 3),
            "pixel to cell; h33 = 1 or −1, w > 0 for ground in front of the camera; NaN where invalid",
            "",
            "bev",
        ),
        Field("valid", "bool", (FRAMES,), "whether there is one"),
        Field("reason", "text", (FRAMES,), "why there is none; empty where there is one"),
        Field("num_points", "int64", (FRAMES,), "corners, or points of evidence, that it rests on"),
        Field(
            "rms_px",
            "float64",
            (FRAMES,),
            "residual at the ground corners of all usable boxes; NaN without any, infinite above the horizon",
            "px",
            "image",
        ),
        Field("rms_cells", "float64", (FRAMES,), "the same residual on the grid", "cells", "bev"),
        Field(
            "plane",
            "float64",
            (FRAMES, 3),
            "of a method that fits one: z = p0 + p1·x + p2·y; NaN where invalid",
            "m",
            "level",
            "optional",
        ),
        Field(
            "left_out_error_m",
            "float64",
            (BOXES,),
            "mean error of the box's ground corners, fitted without it; NaN where refused or not evaluated",
            "m",
            "level",
            "optional",
        ),
        Field(
            "left_out_refused",
            "bool",
            (BOXES,),
            "whether the method had no answer without the box",
            part="optional",
        ),
    ),
    (
        Attribute("method", str, "how it was found, such as `surface`"),
        Attribute("settings", str, "the method's settings, as JSON"),
        Attribute("checkpoint_sha256", str, "the network's weights; empty where there are none"),
        Attribute("package_version", str, "ogmkit's version that added it"),
    ),
)

FOOTPRINTS = AddedKind(
    "footprints",
    "set",
    (
        Field(
            "drivable",
            "uint8",
            (FRAMES, HEIGHT, WIDTH),
            "1 where the pixel shows drivable area",
            "",
            "image",
            "map",
        ),
        Field("vehicles", "uint8", (FRAMES, HEIGHT, WIDTH), "1 where the pixel shows a vehicle", "", "image"),
        Field("valid", "bool", (FRAMES,), "whether the masks were made; they are 0 where not"),
    ),
    (
        Attribute(
            "homography",
            str,
            "source of the homography, or each mask's; where not warped, of the ground under drivable area",
        ),
        Attribute("method", str, "`warp`, `project` or `full-body`"),
        Attribute("scale", float, "image size / mask size"),
        Attribute("settings", str, "where warped, the homographies' attributes at that time, as JSON"),
        Attribute("package_version", str, "ogmkit's version that added it"),
    ),
)

ADDED = (HOMOGRAPHY, FOOTPRINTS)
"""Kinds of groups that a shard may hold below each camera's, `/<CAMERA>/<kind>/<name>/…`."""


def fields(parts: Collection[Part]) -> tuple[Field, ...]:
    """The datasets of these parts that a camera's group holds."""
    return tuple(field for field in _OF_CAMERAS if field.part in parts)


def field_of(name: str) -> Field | None:
    """The field of a dataset by its name below a group, such as `homography/surface/valid`, or None."""
    kind, _, rest = name.partition("/")
    inner = rest.partition("/")[2]
    if kind == LABELS:
        return label_field(inner)
    added = next((one.fields for one in ADDED if one.name == kind), None)
    known, own = ((*_OF_CAMERAS, *POSES), name) if added is None else (added, inner)
    return next((field for field in known if field.name == own), named_field(name))
