"""Figures of a dataset as a whole: what single records can't tell, such as quaternions in another order.

Each is a share or a median that sound data keep well away from its limit; few records prove nothing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ogmkit.nuscenes.categories import VEHICLE_WORD
from ogmkit.nuscenes.tables import Tables

_LEAN_COSINE = 0.7
"""Of the angle between two upright axes: about 45°."""
_LEAST_STEPS, _LEAST_BOXES = 5, 20
_LEAST_STEP_M = 0.5
_NEAR_M = 20.0
_GROUND_TOLERANCE_M = 0.5
_MOST_SHARE = 0.5

_UP = "1 - 2 * ({0}rotation[2] ** 2 + {0}rotation[3] ** 2)"
"""Cosine between a rotated z axis and the vertical; of a camera, between optical axis and vertical."""

_POSES = f"SELECT count(*) FILTER ({_UP.format('')} < {_LEAN_COSINE}), count(*) FROM key_frame"
_BOXES = (
    f"SELECT count(*) FILTER ({_UP.format('')} < {_LEAN_COSINE}), count(*) FROM sample_annotation "
    f"HAVING count(*) >= {_LEAST_BOXES}"
)
_CAMERAS = (
    f"SELECT count(*) FILTER (abs({_UP.format('c.')}) > {_LEAN_COSINE}), count(*) FROM calibrated_sensor c "
    "JOIN sensor e ON e.token = c.sensor_token WHERE e.modality = 'camera'"
)
_DRIVING = f"""
SELECT count(*) FILTER (ahead < {_LEAN_COSINE} * moved), count(*) FROM (
    SELECT sqrt(dx ** 2 + dy ** 2) AS moved, dx * (1 - 2 * (r[3] ** 2 + r[4] ** 2))
        + dy * 2 * (r[2] * r[3] + r[1] * r[4]) AS ahead
    FROM (
        SELECT rotation AS r, lead(translation[1]) OVER later - translation[1] AS dx,
            lead(translation[2]) OVER later - translation[2] AS dy
        FROM key_frame WINDOW later AS (PARTITION BY scene, channel ORDER BY sample_timestamp, row)
    )
) WHERE moved > {_LEAST_STEP_M} HAVING count(*) >= {_LEAST_STEPS}
"""
_OF_VEHICLES = f"""
    sample_annotation a JOIN instance i ON i.token = a.instance_token
    JOIN category c ON c.token = i.category_token AND regexp_matches(lower(c.name), '{VEHICLE_WORD}')
"""
_WIDTHS = (
    f"SELECT count(*) FILTER (a.size[1] > a.size[2]), count(*) FROM {_OF_VEHICLES} "
    f"HAVING count(*) >= {_LEAST_BOXES}"
)
_BOTTOMS = f"""
SELECT median(a.translation[3] - a.size[3] / 2 - p.translation[3]), count(*) FROM {_OF_VEHICLES}
JOIN (SELECT sample_token, min_by(translation, row) AS translation FROM key_frame GROUP BY 1) p
    ON p.sample_token = a.sample_token
WHERE (a.translation[1] - p.translation[1]) ** 2 + (a.translation[2] - p.translation[2]) ** 2 < {_NEAR_M**2}
HAVING count(*) >= {_LEAST_BOXES}
"""


@dataclass(frozen=True)
class Plausibility:
    """One such figure.

    Attributes:
        id: such as R801.
        title: what is wrong where the figure is beyond its limit.
        remedy: what to do then.
        sql: gives at most one row: a number of records, or a median in metres; and of how many records.
        text: the figure in words, with `{value}`, `{count}` and `{share}`.
        implausible: whether it is beyond its limit.
    """

    id: str
    title: str
    remedy: str
    sql: str
    text: str
    implausible: Callable[[float, int], bool]


def _mostly(value: float, count: int) -> bool:
    return value > _MOST_SHARE * count


def _off_ground(value: float, count: int) -> bool:
    del count
    return abs(value) > _GROUND_TOLERANCE_M


_QUATERNION_ORDER = (
    "write rotations as quaternions w, x, y, z (scalar first), from the body to its parent frame"
)
FIGURES = (
    Plausibility(
        "R801",
        "ego poses lean",
        _QUATERNION_ORDER,
        _POSES,
        "{value:,} of {count:,} key-frame poses lean by more than 45° ({share:.0%})",
        _mostly,
    ),
    Plausibility(
        "R802",
        "ego moves across or against its heading",
        f"{_QUATERNION_ORDER}; x points ahead",
        _DRIVING,
        "in {value:,} of {count:,} steps between key frames, the ego moves by more than 45° off its x axis "
        "({share:.0%})",
        _mostly,
    ),
    Plausibility(
        "R803",
        "boxes lean",
        _QUATERNION_ORDER,
        _BOXES,
        "{value:,} of {count:,} boxes lean by more than 45° ({share:.0%})",
        _mostly,
    ),
    Plausibility(
        "R804",
        "vehicles are wider than long",
        "write sizes as width, length, height",
        _WIDTHS,
        "{value:,} of {count:,} boxes of vehicles are wider than long ({share:.0%})",
        _mostly,
    ),
    Plausibility(
        "R805",
        "boxes float or are sunk into the ground",
        "write a box's translation as its centre, half its height above the ground, in the global frame",
        _BOTTOMS,
        f"{{count:,}} boxes of vehicles within {_NEAR_M:.0f} m stand {{value:+.2f}} m above the ego's ground "
        "(median of their bottoms)",
        _off_ground,
    ),
    Plausibility(
        "R806",
        "cameras look up or down",
        f"{_QUATERNION_ORDER}; a camera's z axis is its line of sight",
        _CAMERAS,
        "{value:,} of {count:,} calibrations of cameras look up or down by more than 45° ({share:.0%})",
        _mostly,
    ),
)


def implausible(tables: Tables) -> Iterator[tuple[Plausibility, str]]:
    """The figures that are beyond their limits, each in words.

    Args:
        tables: loaded and prepared (`uses.prepare`).
    """
    for figure in FIGURES:
        for value, count in tables.rows(figure.sql):
            if count and value is not None and figure.implausible(value, count):
                yield figure, figure.text.format(value=value, count=count, share=value / count)
