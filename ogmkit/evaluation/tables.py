"""Tables of text, and what stands around them: what every evaluation is written as."""

import math
from dataclasses import dataclass
from typing import Protocol

from ogmkit.evaluation.planning.result import PlanFigure
from ogmkit.evaluation.result import Figure

NOTHING = "NA"
"""What a table shows where there is no figure, as the paper has it."""


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


@dataclass(frozen=True, eq=False)
class Report:
    """An evaluation, ready to be written.

    Attributes:
        heading: what all figures were found on, in one line.
        tables: in order.
        explanations: sentences to be read with the tables.
        keys: names of a figure's fields, in order.
        figures: all of them; the tables show a part.
    """

    heading: str
    tables: tuple[Table, ...]
    explanations: tuple[str, ...]
    keys: tuple[str, ...]
    figures: tuple[Figure, ...] | tuple[PlanFigure, ...]


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


def with_interval(one: Interval, decimals: int, factor: float = 1.0, between: str = "–") -> str:
    """`0.48 [0.40–0.57]`, or `NOTHING`.

    Args:
        one: the figure.
        decimals: places after the point.
        factor: what numbers are multiplied by, such as 100 for %.
        between: stands between the interval's ends; for figures that may be negative, no dash.
    """
    if math.isnan(one.value):
        return NOTHING
    value, low, high = (
        f"{factor * number:.{decimals}f}".replace("-", "−") for number in (one.value, one.low, one.high)
    )
    return f"{value} [{low}{between}{high}]"


def counted(count: int, noun: str) -> str:
    """`1 frame`, `1,234 frames`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"
