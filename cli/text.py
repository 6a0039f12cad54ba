"""Text for terminals and programs: tables, counts, messages of one line, JSON."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, is_dataclass

from ogmkit.base.names import with_number

__all__ = ["one_line", "text_table", "with_number"]


def text_table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Columns two spaces apart under their headers, numbers to the right; one line a row."""
    lines = [list(header), *([_shown(value) for value in row] for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    right = [
        bool(rows) and all(isinstance(row[column], int | float) for row in rows)
        for column in range(len(header))
    ]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if to_right else cell.ljust(width)
            for cell, width, to_right in zip(line, widths, right, strict=True)
        ).rstrip()
        for line in lines
    )


def one_line(text: str) -> str:
    """Text without line breaks or control characters: names in datasets may hold anything."""
    shown = (
        character if character.isprintable() else " " if character.isspace() else ascii(character)[1:-1]
        for character in text
    )
    return "".join(shown)


def lines_text(lines: Iterable[str]) -> str:
    """Join lines, escaping the line breaks and control characters inside each."""
    return "\n".join(map(one_line, lines))


def json_text(content: object) -> str:
    """One JSON document, in ASCII: records as objects, numbers that aren't finite as null."""
    return json.dumps(_plain(content), indent=2, allow_nan=False)


def _plain(value: object) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, int | str | None) else str(value)


def _shown(value: object) -> str:
    return f"{value:,}" if isinstance(value, int) else one_line(str(value))
