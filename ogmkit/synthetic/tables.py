"""The thirteen tables of a nuScenes dataset: their rows, links between them, and their files."""

import json
from collections.abc import Sequence
from pathlib import Path

from ogmkit.synthetic.catalogue import ATTRIBUTES, CATEGORIES, VISIBILITIES
from ogmkit.synthetic.plan import LogPlan, token
from ogmkit.synthetic.rig import LIDAR
from ogmkit.synthetic.sensors import Sensor

Row = dict[str, object]

TABLES = (
    "attribute",
    "calibrated_sensor",
    "category",
    "ego_pose",
    "instance",
    "log",
    "map",
    "sample",
    "sample_annotation",
    "sample_data",
    "scene",
    "sensor",
    "visibility",
)


class Tables:
    """Rows in the making; `seed` makes their tokens."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.rows: dict[str, list[Row]] = {name: [] for name in TABLES}

    def token(self, table: str, *indices: object) -> str:
        """The token of a record, whether it exists yet or not."""
        return token(self.seed, table, *indices)

    def add(self, table: str, record: str, row: Row) -> None:
        """Append a row under a token."""
        self.rows[table].append({"token": record, **row})

    def add_chain(self, table: str, rows: Sequence[Row]) -> None:
        """Append rows that have tokens already, linked by `prev` and `next` in their order."""
        for position, row in enumerate(rows):
            before = rows[position - 1]["token"] if position else ""
            after = rows[position + 1]["token"] if position + 1 < len(rows) else ""
            self.rows[table].append({**row, "prev": before, "next": after})

    def write(self, folder: Path) -> None:
        """Write one JSON file a table, one record a line."""
        for name, rows in self.rows.items():
            lines = ",\n".join(json.dumps(row, allow_nan=False, separators=(",", ":")) for row in rows)
            (folder / f"{name}.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def add_vocabulary(tables: Tables, channels: Sequence[str]) -> None:
    """Categories, attributes, visibility levels and sensors: the same in every dataset."""
    for table, names in (("category", CATEGORIES), ("attribute", ATTRIBUTES)):
        for name, description in names.items():
            tables.add(table, tables.token(table, name), {"name": name, "description": description})
    for level, (low, high) in VISIBILITIES.items():
        description = f"visibility of whole object is between {low} and {high}%"
        tables.add("visibility", level, {"description": description, "level": f"v{low}-{high}"})
    for channel in channels:
        row: Row = {"channel": channel, "modality": "lidar" if channel == LIDAR else "camera"}
        tables.add("sensor", tables.token("sensor", channel), row)


def add_log(tables: Tables, log: LogPlan, sensors: Sequence[Sensor]) -> None:
    """A log and how its sensors were mounted."""
    tables.add("log", tables.token("log", log.index), log.row)
    for sensor in sensors:
        row: Row = {
            "sensor_token": tables.token("sensor", sensor.channel),
            "translation": sensor.translation,
            "rotation": sensor.rotation,
            "camera_intrinsic": [] if sensor.intrinsics is None else sensor.intrinsics.tolist(),
        }
        tables.add("calibrated_sensor", tables.token("calibrated_sensor", log.index, sensor.channel), row)


def add_map(tables: Tables, location: str, logs: Sequence[LogPlan]) -> str:
    """A location's mask for all its logs; returns the mask's path relative to the dataset's root."""
    record = tables.token("map", location)
    filename = f"maps/{record}.png"
    row: Row = {
        "category": "semantic_prior",
        "filename": filename,
        "log_tokens": [tables.token("log", log.index) for log in logs],
    }
    tables.add("map", record, row)
    return filename
