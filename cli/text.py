"""Text for terminals: tables, counts, messages of one line."""

from collections.abc import Sequence


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


def with_number(count: int, noun: str) -> str:
    """`1 box`, `2 boxes`."""
    ending = "" if count == 1 else "es" if noun.endswith("x") else "s"
    return f"{count:,} {noun}{ending}"


def one_line(text: str) -> str:
    """Text without line breaks or control characters: names in datasets may hold anything."""
    shown = (
        character if character.isprintable() else " " if character.isspace() else ascii(character)[1:-1]
        for character in text
    )
    return "".join(shown)


def _shown(value: object) -> str:
    return f"{value:,}" if isinstance(value, int) else str(value)
