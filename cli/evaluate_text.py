"""Evaluations as text for terminals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .text import text_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.evaluation.tables import Report, Table


def report_text(report: Report) -> str:
    """All tables, between heading and explanations."""
    return "".join(f"{line}\n" for line in _lines(report))


def _lines(report: Report) -> Iterator[str]:
    yield report.heading
    for table in report.tables:
        yield ""
        yield table.title
        yield from _table_lines(table)
    yield ""
    yield from report.explanations


def _table_lines(table: Table) -> Iterator[str]:
    """A table with its groups above and a rule over its fixed rows."""
    rows = (*table.systems, *table.fixed)
    widths = [max(len(line[column]) for line in (table.header, *rows)) for column in range(len(table.header))]

    def aligned(line: tuple[str, ...]) -> list[str]:
        return [line[0], *(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True))]

    header, *lines = text_table(aligned(table.header), [aligned(row) for row in rows]).splitlines()
    left = widths[0] + 2
    above = " " * left
    first = 1
    for text, columns in table.groups:
        width = sum(widths[first : first + columns]) + 2 * (columns - 1)
        above += f" {text} ".center(width, "-") + "  "
        first += columns
    if table.groups:
        yield above.rstrip()
    yield header
    yield from lines[: len(table.systems)]
    if table.systems:
        yield "-" * max(map(len, lines))
    yield from lines[len(table.systems) :]
