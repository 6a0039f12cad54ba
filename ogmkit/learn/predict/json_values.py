"""JSON files that users write: read whole, their values checked key by key."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.base.files import read_text
from ogmkit.base.names import unknown
from ogmkit.errors import TableError
from ogmkit.typing import FloatArray

Reader = Callable[[str, object], Any]
"""Key and JSON value → what is meant; raises ValueError, with the key, where the value is none."""


def json_object(path: Path, keys: Iterable[str]) -> dict[str, Any]:
    """Read a file that holds one JSON object.

    Args:
        path: the file.
        keys: that it may have, for messages.

    Raises:
        TableError: it is absent, too large, no JSON, or no object with anything in it.
    """
    try:
        content = json.loads(read_text(path))
    except OSError as error:
        raise TableError(f"{path}: can't be read ({error.strerror}); choose another file") from error
    except (ValueError, RecursionError) as error:
        raise TableError(f"{path}: not JSON ({error}); correct it") from error
    if not isinstance(content, dict) or not content:
        raise TableError(f"{path}: holds no object with {', '.join(keys)}; correct it")
    return content


def checked(
    values: Mapping[str, Any], keys: Mapping[str, Reader], needs: Sequence[str], place: str
) -> dict[str, Any]:
    """An object's values as its keys' readers give them.

    Args:
        values: the object.
        keys: what it may hold, and what reads and checks it.
        needs: keys that must be there.
        place: what messages call it.

    Raises:
        TableError: a key is unknown or missing, or a value is not as it should be.
    """
    for key in values:
        if key not in keys:
            raise TableError(f"{place}: {unknown('key', key, tuple(keys))}")
    for key in needs:
        if key not in values:
            raise TableError(f"{place}: {key} is missing; add it")
    try:
        return {key: keys[key](key, value) for key, value in values.items()}
    except ValueError as error:
        raise TableError(f"{place}: {error}") from error


def numbers(key: str, value: object, rows: int, columns: int) -> FloatArray:
    """(rows, columns) float64 of a list of lists.

    Raises:
        ValueError: it is none of this shape, or a number is not finite.
    """
    lines = value if isinstance(value, list) else []
    fitting = len(lines) == rows and all(isinstance(line, list) and len(line) == columns for line in lines)
    if not fitting or not all(type(entry) in (int, float) for line in lines for entry in line):
        raise ValueError(f"{key} is not {rows} rows of {columns} numbers")
    try:
        matrix = np.array(lines, dtype=np.float64)
    except OverflowError as error:  # JSON has integers of any length
        raise ValueError(f"{key} holds a number that is too large") from error
    if not np.isfinite(matrix).all():
        raise ValueError(f"{key} holds a number that is not finite")
    return matrix
