"""Both tables of an evaluation, read from what `ogmkit evaluate --format json` writes."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from ogmkit.base.files import read_text
from ogmkit.errors import TableError

_REMEDY = "write it by `ogmkit evaluate --format json`"
_PERCEPTION = ("metric", "cells")
_PLANNING = ("definition", "metric", "reading")
_COLUMNS = {_PERCEPTION: ("target", "view", "region"), _PLANNING: ("horizon_s",)}
_WORDS = {
    "foreground_iou": "Foreground IoU",
    "mean_iou": "Mean of foreground and background IoU",
    "tuned_iou": "Foreground IoU at each run’s own thresholds",
    "ade": "ADE in m",
    "l1_longitudinal": "L1 longitudinal in m",
    "l1_lateral": "L1 lateral in m",
    "nll": "NLL in nats",
    "l2": "L2 in m",
}
"""Metrics as the tables call them; others by their own name."""
_CELLS = {"all": "all cells", "fov": "cells in the field of view"}
_READINGS = {"at": "at the horizon", "mean": "mean up to the horizon", "up-to": "at any point up to it"}
_SHARES = (
    *("foreground_iou", "mean_iou", "tuned_iou", "pairs_separated"),
    *("inside_50", "inside_90", "off_drivable", "in_vehicle"),
    *("collision", "point_collision", "edge_crossing"),
)
"""Metrics between 0 and 1, which are shown in %."""


@dataclass(frozen=True)
class Score:
    """A figure with the ends of its interval; NaN where undefined."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class ScoreTable:
    """One reading of a table.

    Attributes:
        title: what the figures are.
        groups: headings over columns: (text, how many columns); none for plans.
        columns: their headings.
        rows: row → a score a column; NaN where there is none.
        flattered: rows that have seen the scenes that are reported.
        plans: whether it is of planners.
    """

    title: str
    groups: tuple[tuple[str, int], ...]
    columns: tuple[str, ...]
    rows: dict[str, tuple[Score, ...]]
    flattered: frozenset[str]
    plans: bool


def read_scores(path: Path) -> tuple[ScoreTable, ...]:
    """The readings of a table, the headline first.

    Raises:
        TableError: the file can't be read, or holds something else.
    """
    try:
        records = json.loads(read_text(path))
        return _tables(records)
    except OSError as error:
        raise TableError(f"{path}: can't be read ({error.strerror}); {_REMEDY}") from error
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise TableError(
            f"{path}: is no table of figures ({type(error).__name__}: {error}); {_REMEDY}"
        ) from error


def _tables(records: Sequence[dict[str, Any]]) -> tuple[ScoreTable, ...]:
    found: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for record in records:
        kind = _PLANNING if "horizon_s" in record else _PERCEPTION
        found.setdefault(tuple(str(record[key]) for key in kind), []).append(record)
    return tuple(_table(ones) for ones in found.values())


def _table(records: Sequence[dict[str, Any]]) -> ScoreTable:
    first = records[0]
    keys = _COLUMNS[_PLANNING if "horizon_s" in first else _PERCEPTION]
    places = {(str(one["system"]), tuple(one[key] for key in keys)): one for one in records}
    columns = tuple(dict.fromkeys(column for _, column in places))
    names = tuple(dict.fromkeys(name for name, _ in places))
    factor = 100 if first["metric"] in _SHARES else 1
    return ScoreTable(
        _title(first),
        _groups(columns),
        tuple(map(_heading, columns)),
        {name: tuple(_score(places.get((name, column)), factor) for column in columns) for name in names},
        frozenset(
            str(one["system"])
            for one in records
            if one.get("chosen_on_reported") or one.get("learnt_from_reported")
        ),
        "horizon_s" in first,
    )


def _score(record: dict[str, Any] | None, factor: float) -> Score:
    values = (None if record is None else record[name] for name in ("value", "low", "high"))
    return Score(*(math.nan if value is None else factor * float(value) for value in values))


def _title(record: dict[str, Any]) -> str:
    metric = str(record["metric"])
    words = [_WORDS.get(metric, metric.replace("_", " ")) + (" in %" if metric in _SHARES else "")]
    if "horizon_s" in record:
        words.append(_READINGS.get(str(record["reading"]), str(record["reading"])))
    else:
        words.append(_CELLS.get(str(record["cells"]), str(record["cells"])))
    definition = str(record.get("definition", "paper"))
    return ", ".join(words) + ("" if definition == "paper" else f" ({definition})")


def _groups(columns: Sequence[tuple[Any, ...]]) -> tuple[tuple[str, int], ...]:
    """Targets, each over its columns."""
    targets = [str(column[0]) for column in columns if len(column) > 1]
    return tuple((target, len([*ones])) for target, ones in groupby(targets))


def _heading(column: tuple[Any, ...]) -> str:
    if len(column) == 1:
        return f"{float(column[0]):g} s"
    _, view, region = column
    if view == "camera":
        return "camera"
    return "BEV full" if region == "full" else str(region)
