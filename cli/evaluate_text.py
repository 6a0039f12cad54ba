"""Evaluations as text for terminals."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from .text import one_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.evaluation.tables import Report, Table

WIDTH = 100
"""Characters of a line at most; names of rows and prose are broken to fit."""
_NAME_WIDTH = 12
"""Characters that names of rows get at least, however wide the figures."""


def report_text(report: Report) -> str:
    """All tables, between heading and explanations."""
    return "".join(f"{one_line(line)}\n" for line in _lines(report))


def _lines(report: Report) -> Iterator[str]:
    yield from _wrapped(report.heading)
    for table in report.tables:
        yield ""
        yield from _wrapped("; ".join(filter(None, (table.title, report.hint))))
        yield from _table_lines(table)
    yield ""
    for line in report.explanations:
        yield from _wrapped(line)


def _wrapped(text: str) -> list[str]:
    """Prose as lines; paths and commands stay whole."""
    return textwrap.wrap(text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def _table_lines(table: Table) -> Iterator[str]:
    """A table with its groups above and a rule over its fixed rows."""
    rows = (*table.systems, *table.fixed)
    widths = [max(len(line[column]) for line in (table.header, *rows)) for column in range(len(table.header))]
    figures = sum(width + 2 for width in widths[1:])
    widths[0] = min(widths[0], max(WIDTH - figures, _NAME_WIDTH))
    above = " " * (widths[0] + 2)
    first = 1
    for text, columns in table.groups:
        width = sum(widths[first : first + columns]) + 2 * (columns - 1)
        above += f" {text} ".center(width, "-") + "  "
        first += columns
    if table.groups:
        yield above.rstrip()
    yield from _row_lines(table.header, widths)
    for row in table.systems:
        yield from _row_lines(row, widths)
    if table.systems:
        yield "-" * (widths[0] + figures)
    for row in table.fixed:
        yield from _row_lines(row, widths)


def _row_lines(row: tuple[str, ...], widths: list[int]) -> Iterator[str]:
    """A row, numbers to the right; a name that is too long continues below, indented."""
    name, *more = textwrap.wrap(row[0], widths[0], subsequent_indent="  ")
    figures = (cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))
    yield "  ".join([name.ljust(widths[0]), *figures])
    yield from more
