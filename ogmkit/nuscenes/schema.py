"""The thirteen nuScenes tables: columns, types, and what they refer to.

Source: the nuScenes schema (nuscenes-devkit, docs/schema_nuscenes.md).
"""

from dataclasses import dataclass

TOKEN = "VARCHAR"
VECTOR = "DOUBLE[3]"
QUATERNION = "DOUBLE[4]"


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        name: its key in the JSON records.
        type: its DuckDB type.
        refers_to: the table whose tokens it holds; None for plain values.
        may_be_empty: an empty string stands for "none" (ends of prev/next chains).
        edge: frame records are made from it; the other columns are read by `ogmkit check` alone.
        optional: it may be absent or null.
    """

    name: str
    type: str = TOKEN
    refers_to: str | None = None
    may_be_empty: bool = False
    edge: bool = True
    optional: bool = False


def _checked(name: str, type: str = TOKEN, refers_to: str | None = None, *, optional: bool = False) -> Column:
    """A column that only `ogmkit check` reads."""
    return Column(name, type, refers_to, edge=False, optional=optional)


def _links(table: str, *, edge: bool, optional: bool = False) -> tuple[Column, ...]:
    """`prev` and `next` within a table."""
    return tuple(
        Column(name, TOKEN, table, may_be_empty=True, edge=edge, optional=optional)
        for name in ("prev", "next")
    )


_TOKEN = Column("token")
_POSE = (Column("translation", VECTOR), Column("rotation", QUATERNION))

# In the order of loading: a table's row filter (tables.py) needs those before it.
TABLES: dict[str, tuple[Column, ...]] = {
    "log": (
        _TOKEN,
        Column("location"),
        _checked("logfile"),
        _checked("vehicle"),
        _checked("date_captured"),
    ),
    "map": (
        _TOKEN,
        Column("filename"),
        Column("log_tokens", "VARCHAR[]"),
        _checked("category"),
    ),
    "scene": (
        _TOKEN,
        Column("name"),
        Column("log_token", TOKEN, "log"),
        Column("nbr_samples", "BIGINT"),
        Column("first_sample_token", TOKEN, "sample"),
        Column("last_sample_token", TOKEN, "sample"),
        _checked("description"),
    ),
    "sample": (
        _TOKEN,
        Column("timestamp", "BIGINT"),
        Column("scene_token", TOKEN, "scene"),
        *_links("sample", edge=True),
    ),
    "sensor": (_TOKEN, Column("channel"), Column("modality")),
    "calibrated_sensor": (
        _TOKEN,
        Column("sensor_token", TOKEN, "sensor"),
        *_POSE,
        Column("camera_intrinsic", "DOUBLE[][]"),
        Column("camera_distortion", "DOUBLE[]", optional=True),  # not nuScenes' own: T4's
    ),
    "sample_data": (
        _TOKEN,
        Column("sample_token", TOKEN, "sample"),
        Column("ego_pose_token", TOKEN, "ego_pose"),
        Column("calibrated_sensor_token", TOKEN, "calibrated_sensor"),
        Column("timestamp", "BIGINT"),
        Column("is_key_frame", "BOOLEAN"),
        Column("height", "BIGINT", optional=True),  # but of cameras: a rule on image sizes
        Column("width", "BIGINT", optional=True),
        Column("filename"),
        _checked("fileformat"),
        *_links("sample_data", edge=False),
    ),
    "ego_pose": (_TOKEN, *_POSE, _checked("timestamp", "BIGINT")),
    "category": (_TOKEN, Column("name"), _checked("description")),
    "instance": (
        _TOKEN,
        Column("category_token", TOKEN, "category"),
        _checked("nbr_annotations", "BIGINT"),
        _checked("first_annotation_token", TOKEN, "sample_annotation"),
        _checked("last_annotation_token", TOKEN, "sample_annotation"),
    ),
    "sample_annotation": (
        _TOKEN,
        Column("sample_token", TOKEN, "sample"),
        Column("instance_token", TOKEN, "instance"),
        Column("visibility_token", optional=True),
        *_POSE,
        Column("size", VECTOR),
        Column("num_lidar_pts", "BIGINT", optional=True),
        _checked("num_radar_pts", "BIGINT", optional=True),
        _checked("attribute_tokens", "VARCHAR[]", optional=True),
        *_links("sample_annotation", edge=False, optional=True),
    ),
    "attribute": (_TOKEN, _checked("name"), _checked("description")),
    "visibility": (_TOKEN, Column("level"), _checked("description")),
}

EDGE_TABLES = tuple(name for name in TABLES if name not in ("attribute", "visibility"))
"""The tables that frame records can't be made without."""


def columns(table: str, *, complete: bool) -> tuple[Column, ...]:
    """A table's columns: all of them, or those that frame records are made from."""
    return tuple(column for column in TABLES[table] if complete or column.edge)
