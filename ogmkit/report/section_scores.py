"""The tables of evaluations: every reading sortable, with its intervals drawn."""

import math
from collections.abc import Iterator, Sequence

from ogmkit.report.html import Html, element
from ogmkit.report.scores import Score, ScoreTable
from ogmkit.report.sections import Section, sortable


def scores_section(identity: str, title: str, source: str, tables: Sequence[ScoreTable]) -> Section:
    """The headline open, the other readings folded up; `source` names the file."""
    readings = (
        element("details", element("summary", one.title), _table(one), open=number == 0)
        for number, one in enumerate(tables)
    )
    note = f"{source}. Lines are 95 % intervals from resampling scenes, on one scale for each column."
    if any(one.flattered for one in tables):
        note += " Rows marked * have seen scenes that are reported."
    return Section(identity, title, note, element("div", *readings, class_="readings"))


def _table(table: ScoreTable) -> Html:
    scales = [
        _ends([scores[column] for scores in table.rows.values()]) for column in range(len(table.columns))
    ]
    rows = (
        (f"{name} *" if name in table.flattered else name, *map(_figure, scores, scales))
        for name, scores in table.rows.items()
        if any(not math.isnan(one.value) for one in scores)
    )
    return sortable(("System", *table.columns), rows, class_="scores", groups=table.groups)


def _ends(scores: Sequence[Score]) -> tuple[float, float]:
    """The least and the largest of a column's figures and ends of intervals."""
    known = [value for one in scores for value in (one.value, one.low, one.high) if math.isfinite(value)]
    return (min(known), max(known)) if known else (0.0, 1.0)


def _figure(score: Score, scale: tuple[float, float]) -> Html:
    """A cell: the figure, and its place with the interval on the column's scale."""
    if math.isnan(score.value):
        return element("td", "–", class_="n", data_v="")
    decimals = 1 if abs(score.value) >= 10 else 2
    title = "" if math.isnan(score.low) else f"{score.low:.{decimals}f} to {score.high:.{decimals}f}"
    drawn = element("span", *_marks(score, scale), class_="ci", aria_hidden="true")
    shown = f"{score.value:,.{decimals}f}".replace("-", "−")
    return element("td", shown, drawn, class_="n", data_v=f"{score.value:g}", title=title or None)


def _marks(score: Score, scale: tuple[float, float]) -> Iterator[Html]:
    low, high = scale
    width = (high - low) or 1.0

    def place(value: float) -> float:
        return 100 * (value - low) / width

    if math.isfinite(score.low) and math.isfinite(score.high):
        left, right = place(score.low), place(score.high)
        yield element("i", style=f"left:{left:.1f}%;width:{max(right - left, 0):.1f}%")
    if math.isfinite(score.value):
        yield element("b", style=f"left:{place(score.value):.1f}%")
