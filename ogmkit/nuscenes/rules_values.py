"""Rules about single values: poses, boxes, calibrations, names."""

from ogmkit.nuscenes.paths import MAX_NAME_BYTES, UNSAFE_NAME, UNSAFE_PATH
from ogmkit.nuscenes.uses import Query, unused, used
from ogmkit.nuscenes.visibility import BY_TOKEN

_UNIT_TOLERANCE = 1e-3
_MAX_IMAGE_SIDE_PX = 65_535
_MAX_TRANSLATION_M = 1e8
_MAX_BOX_SIDE_M = 1e4
_FIRST_DATE, _LAST_DATE = 0.9, 3.0  # 1998 and 2065, in thousand million seconds
_POSED = ("ego_pose", "calibrated_sensor", "sample_annotation")


def _unsound(table: str, column: str, sound: str, problem: str) -> Query:
    """Rows whose value is there but not known to be sound; NaN and NULL elements fail every comparison."""
    return used(
        table,
        f"SELECT rowid AS row, token AS record, '{column} ' || {column}::VARCHAR || ' {problem}' AS detail "
        f"FROM {table} WHERE {column} IS NOT NULL AND ({sound}) IS NOT TRUE",
    )


def _of_cameras(table: str, calibration: str, column: str, sound: str, problem: str) -> Query:
    return used(
        table,
        f"SELECT t.rowid AS row, t.token AS record, {column} || ' {problem}' AS detail FROM {table} t "
        f"SEMI JOIN (SELECT c.token FROM calibrated_sensor c JOIN sensor e ON e.token = c.sensor_token "
        f"WHERE e.modality = 'camera') camera ON camera.token = t.{calibration} WHERE ({sound}) IS NOT TRUE",
    )


QUATERNIONS = tuple(
    _unsound(
        table,
        "rotation",
        "abs(sqrt(rotation[1] ** 2 + rotation[2] ** 2 + rotation[3] ** 2 + rotation[4] ** 2) - 1) "
        f"<= {_UNIT_TOLERANCE}",
        "is not a unit quaternion",
    )
    for table in _POSED
)
TRANSLATIONS = tuple(
    _unsound(
        table,
        "translation",
        " AND ".join(f"abs(translation[{i}]) <= {_MAX_TRANSLATION_M}" for i in (1, 2, 3)),
        f"is not three finite numbers within {_MAX_TRANSLATION_M:g} m",
    )
    for table in _POSED
)
BOX_SIZES = (
    _unsound(
        "sample_annotation",
        "size",
        " AND ".join(f"size[{i}] > 0 AND size[{i}] <= {_MAX_BOX_SIDE_M}" for i in (1, 2, 3)),
        f"is not three positive lengths up to {_MAX_BOX_SIDE_M:g} m",
    ),
)
VISIBILITIES = (
    unused(
        "sample_annotation",
        "SELECT a.token AS record, 'visibility_token ''' || a.visibility_token || ''' ' || CASE "
        "WHEN v.token IS NULL THEN 'is not in visibility.json' "
        "ELSE 'stands for level ' || coalesce('''' || v.level || '''', 'null') END AS detail "
        f"FROM sample_annotation a LEFT JOIN {BY_TOKEN} v ON v.token = a.visibility_token "
        "WHERE a.visibility_token <> '' AND coalesce(v.number, 0) = 0",
    ),
)
TIMESTAMPS = tuple(
    _unsound(table, "timestamp", "timestamp > 0", "is not a positive number of microseconds")
    for table in ("sample", "sample_data")
)
_OTHER_UNITS = {"seconds": 1e9, "milliseconds": 1e12, "nanoseconds": 1e18}
"""Unit → how many of it make a thousand million seconds."""
TIME_UNITS = tuple(
    _unsound(
        table,
        "timestamp",
        f"NOT (timestamp >= {_FIRST_DATE * size:.0f} AND timestamp < {_LAST_DATE * size:.0f})",
        f"is in {unit} by its size, not in microseconds",
    )
    for table in ("sample", "sample_data")
    for unit, size in _OTHER_UNITS.items()
)


def _k(row: int, column: int) -> str:
    return f"t.camera_intrinsic[{row}][{column}]"


_DETERMINANT = " + ".join(
    f"{_k(1, a)} * ({_k(2, b)} * {_k(3, c)} - {_k(2, c)} * {_k(3, b)})"
    for a, b, c in ((1, 2, 3), (2, 3, 1), (3, 1, 2))
)
_ROWS_OF_THREE = " AND ".join(f"len(t.camera_intrinsic[{row}]) = 3" for row in (1, 2, 3))
INTRINSICS = (
    _of_cameras(
        "calibrated_sensor",
        "token",
        "'camera_intrinsic ' || t.camera_intrinsic::VARCHAR",
        f"len(t.camera_intrinsic) = 3 AND {_ROWS_OF_THREE} AND abs({_DETERMINANT}) > 1e-9 "
        f"AND isfinite({_DETERMINANT}) AND {_k(3, 1)} = 0 AND {_k(3, 2)} = 0 AND {_k(3, 3)} = 1",
        "is not an invertible 3×3 matrix with last row 0, 0, 1",
    ),
)
_ALL_ZERO = " AND ".join(f"coalesce(list_{end}(t.camera_distortion), 0) = 0" for end in ("min", "max"))
DISTORTIONS = (
    _of_cameras(
        "calibrated_sensor",
        "token",
        "'camera_distortion ' || t.camera_distortion::VARCHAR",
        _ALL_ZERO,
        "is not all zero: targets assume an image without lens distortion",
    ),
)
IMAGE_SIZES = (
    _of_cameras(
        "sample_data",
        "calibrated_sensor_token",
        "'image size ' || coalesce(t.width::VARCHAR, 'null') || ' × ' || coalesce(t.height::VARCHAR, 'null')",
        " AND ".join(f"t.{side} BETWEEN 1 AND {_MAX_IMAGE_SIDE_PX}" for side in ("width", "height")),
        f"is not between 1 and {_MAX_IMAGE_SIDE_PX} pixels a side",
    ),
)
FILE_NAMES = tuple(
    _unsound(
        table,
        "filename",
        f"NOT regexp_matches(filename, '{UNSAFE_PATH}')",
        "is not a path inside the dataset",
    )
    for table in ("sample_data", "map")
)


def _file_names(table: str, column: str) -> Query:
    sound = f"NOT regexp_matches({column}, '{UNSAFE_NAME}') AND strlen({column}) <= {MAX_NAME_BYTES}"
    return _unsound(table, column, sound, "cannot be a file name")


SCENE_NAMES = (
    _file_names("scene", "name"),
    _unsound(
        "scene",
        "name",
        "lower(name) NOT IN "
        "(SELECT lower(name) FROM scene WHERE name IS NOT NULL GROUP BY 1 HAVING count(*) > 1)",
        "stands for several scenes (upper and lower case count as equal)",
    ),
)
CHANNELS = (_file_names("sensor", "channel"),)
MAPS = (
    used(
        "scene",
        "SELECT c.rowid AS row, c.token AS record, 'log ''' || c.log_token || ''' is listed by ' "
        "|| count(m.token) || ' records of map.json, not one' AS detail FROM scene c "
        "LEFT JOIN map m ON list_contains(m.log_tokens, c.log_token) "
        "GROUP BY c.rowid, c.token, c.log_token HAVING count(m.token) <> 1",
    ),
)
LISTED_LOGS = (
    unused(
        "map",
        "SELECT token AS record, 'lists ' || count(*) || ' logs that log.json lacks' AS detail "
        "FROM (SELECT token, unnest(log_tokens) AS log_token FROM map) m "
        "ANTI JOIN log l ON l.token = m.log_token GROUP BY token",
    ),
)
LISTED_ATTRIBUTES = (
    unused(
        "sample_annotation",
        "SELECT token AS record, 'attribute ''' || attribute_token || ''' is not in attribute.json' "
        "AS detail FROM (SELECT token, unnest(attribute_tokens) AS attribute_token FROM sample_annotation) a "
        "ANTI JOIN attribute t ON t.token = a.attribute_token",
    ),
)
