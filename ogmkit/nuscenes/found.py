"""What stands in a record instead of a value of the column's type, in words."""

import json
from typing import Any

from ogmkit.nuscenes.paths import one_line
from ogmkit.nuscenes.schema import QUATERNION, TABLES, VECTOR
from ogmkit.nuscenes.tables import Tables

WRONG_VALUE = "R201"
"""The rule on values that are missing or of the wrong type."""

_EXPECTED = {
    VECTOR: "3 numbers",
    QUATERNION: "4 numbers, a quaternion w, x, y, z",
    "BIGINT": "a whole number",
    "BOOLEAN": "true or false",
    "VARCHAR": "text",
    "VARCHAR[]": "a list of text",
    "DOUBLE[][]": "3 rows of 3 numbers",
}
_SHOWN_CHARACTERS = 40


def with_found(tables: Tables, rule: str, table: str, record: str, detail: str) -> str:
    """A violation's detail; of a value that is missing or of the wrong type, with what was found instead.

    Args:
        tables: where the record is from.
        rule: the number of the rule.
        table: whose record it is.
        record: its token.
        detail: where the rule is on such values, begins with the names of columns, separated by commas.
    """
    if rule != WRONG_VALUE:
        return detail
    expected = {column.name: column for column in TABLES[table]}
    name = detail.split(" ")[0].rstrip(",")
    if name not in expected:
        return detail
    values = tables.raw(table, name, record)
    if not values:
        return detail
    none = ', "" for none' if expected[name].may_be_empty else ""
    return f"{detail}: {name} is {_in_words(values[0])}, not {_EXPECTED[expected[name].type]}{none}"


def _in_words(text: str | None) -> str:
    if text is None:
        return "absent or null"
    value: Any = json.loads(text)
    if isinstance(value, list):
        if value and all(isinstance(row, list) and len(row) == len(value[0]) for row in value):
            return f"a {len(value)}×{len(value[0])} matrix"
        if all(isinstance(one, (int, float)) for one in value):
            return f"{len(value)} numbers"
    shown = one_line(text)
    return shown if len(shown) <= _SHOWN_CHARACTERS else f"{shown[:_SHOWN_CHARACTERS]}…"
