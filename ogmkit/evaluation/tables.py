"""Tables of text, and what stands around them: what every evaluation is written as."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

NOTHING = "NA"
"""What a table shows where there is no figure, as the paper has it."""
WITH_INTERVAL = " [95 % interval]"
"""What a title says where figures stand with their intervals."""


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes:
        title: names what the figures are.
        groups: headings over columns after the first: (text, how many columns).
        header: of every column.
        systems: rows of runs.
        fixed: rows that need no run.
    """

    title: str
    groups: tuple[tuple[str, int], ...]
    header: tuple[str, ...]
    systems: tuple[tuple[str, ...], ...]
    fixed: tuple[tuple[str, ...], ...]

    def by_group(self) -> tuple["Table", ...]:
        """A table for each group of columns, each with the names of the rows."""
        first, parts = 1, []
        for text, count in self.groups:
            header, systems, fixed = (
                tuple((line[0], *line[first : first + count]) for line in lines)
                for lines in ((self.header,), self.systems, self.fixed)
            )
            parts.append(Table(f"{self.title}: {text}", (), header[0], systems, fixed))
            first += count
        return tuple(parts)


@dataclass(frozen=True)
class Report:
    """An evaluation, ready to be written.

    Attributes:
        heading: what all figures were found on, in one line.
        tables: in order; the first one is the headline.
        left_out: what the tables that are left out hold; empty where all are there.
        explanations: sentences to be read with the tables.
    """

    heading: str
    tables: tuple[Table, ...]
    left_out: str
    explanations: tuple[str, ...]

    @property
    def hint(self) -> str:
        """How to get the tables that are left out; empty where all are there."""
        return self.left_out and f"`ogmkit evaluate --all` adds {self.left_out}"


class Interval(Protocol):
    """A figure with the ends of its interval; NaN where undefined."""

    @property
    def value(self) -> float:
        """The figure."""

    @property
    def low(self) -> float:
        """Lower end."""

    @property
    def high(self) -> float:
        """Upper end."""


def further_tables(readings: Sequence[Table], intervals: bool) -> tuple[Table, ...]:
    """What stands below the headline.

    Args:
        readings: tables, the first one of the headline's figures.
        intervals: whether they hold intervals, which take a table for each group of columns; without them,
            the first one is the headline.
    """
    if not intervals:
        return tuple(readings[1:])
    return tuple(part for table in readings for part in table.by_group())


def shown(
    one: Interval, decimals: int, *, factor: float = 1.0, between: str = "–", interval: bool = True
) -> str:
    """`0.48 [0.40–0.57]`, `0.48` where there is no interval, or `NOTHING`.

    Args:
        one: the figure.
        decimals: places after the point.
        factor: what numbers are multiplied by, such as 100 for %.
        between: stands between the interval's ends; for figures that may be negative, no dash.
        interval: False leaves it out.
    """
    if math.isnan(one.value):
        return NOTHING
    value, low, high = (
        f"{factor * number:.{decimals}f}".replace("-", "−") for number in (one.value, one.low, one.high)
    )
    return f"{value} [{low}{between}{high}]" if interval and not math.isnan(one.low) else value


def counted(count: int, noun: str) -> str:
    """`1 frame`, `1,234 frames`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"
