"""An evaluation, of grids, plans or other networks' grids, as CSV, JSON, Markdown or LaTeX."""

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, fields
from typing import Any

from ogmkit.evaluation.label_report import label_report
from ogmkit.evaluation.label_result import LabelEvaluation, LabelFigure
from ogmkit.evaluation.planning.report import plan_report
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure
from ogmkit.evaluation.report import iou_report
from ogmkit.evaluation.result import Evaluation, Figure
from ogmkit.evaluation.tables import Report, Table

Tabled = Evaluation | PlanEvaluation | LabelEvaluation

_FIGURES = {Evaluation: Figure, PlanEvaluation: PlanFigure, LabelEvaluation: LabelFigure}
_SEEN = ("chosen_on_reported", "learnt_from_reported")
"""What records say of a row besides its figures."""
_LATEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "–": "--",
    "−": "$-$",
    "×": r"$\times$",
}


def report_of(evaluation: Tabled, all_tables: bool = True) -> Report:
    """An evaluation's tables, or the headline alone, and what stands around them."""
    if isinstance(evaluation, Evaluation):
        return iou_report(evaluation, all_tables)
    if isinstance(evaluation, LabelEvaluation):
        return label_report(evaluation)
    return plan_report(evaluation, all_tables)


def as_csv(evaluation: Tabled) -> str:
    """A line of keys, then a line for every figure, whatever tables show; what is undefined is left empty.

    Text that a spreadsheet would take for a formula has an apostrophe before it.
    """
    text = io.StringIO()
    keys = [*(field.name for field in fields(_FIGURES[type(evaluation)])), *_seen(evaluation)]
    writer = csv.DictWriter(text, keys, lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        {key: _safe(value) if isinstance(value, str) else value for key, value in record.items()}
        for record in _records(evaluation)
    )
    return text.getvalue()


def as_json(evaluation: Tabled) -> str:
    """A flat list of objects, one for every figure, whatever tables show; what is undefined is null."""
    lines = ",\n".join(json.dumps(record, allow_nan=False) for record in _records(evaluation))
    return f"[\n{lines}\n]\n"


def as_markdown(evaluation: Tabled, all_tables: bool = True) -> str:
    """All tables, or the headline alone, between heading and explanations."""
    report = report_of(evaluation, all_tables)
    parts = [f"**Evaluation** — {_plain(report.heading)}"]
    for table in report.tables:
        parts += [f"**{table.title}**", "\n".join(_markdown_lines(table))]
    hint = [f"- {report.hint}."] if report.hint else []
    parts.append("\n".join([*hint, *(f"- {_plain(line)}" for line in report.explanations)]))
    return "\n\n".join(parts) + "\n"


def as_latex(evaluation: Tabled, all_tables: bool = True) -> str:
    """The same tables for the package booktabs."""
    report = report_of(evaluation, all_tables)
    parts = ["% needs \\usepackage{booktabs}", f"% {report.heading}"]
    parts += [f"% {line}" for line in (report.hint, *report.explanations) if line]
    parts += ["\n".join(_latex_lines(table, report.heading)) for table in report.tables]
    return "\n".join(" ".join(part.splitlines()) if part.startswith("%") else part for part in parts) + "\n"


def _records(evaluation: Tabled) -> Iterator[dict[str, Any]]:
    """A record of every figure, and whether its row has seen the scenes."""
    rows = {key: getattr(evaluation, key) for key in _seen(evaluation)}
    named = evaluation.named if isinstance(evaluation, PlanEvaluation) else ()
    for figure in (*evaluation.figures, *named):
        values = asdict(figure) | {key: figure.system in names for key, names in rows.items()}
        yield {
            key: None if isinstance(value, float) and math.isnan(value) else value
            for key, value in values.items()
        }


def _seen(evaluation: Tabled) -> tuple[str, ...]:
    """Keys of what is said of rows; grids of other networks say nothing of what those have seen."""
    return () if isinstance(evaluation, LabelEvaluation) else _SEEN


def _safe(text: str) -> str:
    """Text that spreadsheets don't take for a formula: an apostrophe before it marks it as text."""
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t")) else text


def _markdown_lines(table: Table) -> Iterator[str]:
    """Markdown has one line of headings: groups stand before their columns' names."""
    groups = [f"{text} " for text, columns in table.groups for _ in range(columns)]
    groups = ["", *groups] if groups else [""] * len(table.header)
    yield _row(group + name for group, name in zip(groups, table.header, strict=True))
    yield _row(["---", *["---:"] * (len(table.header) - 1)])
    for row in (*table.systems, *table.fixed):
        yield _row(_plain(cell) for cell in row)


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _plain(text: str) -> str:
    """Text that stands in a cell or line of Markdown as it is."""
    for sign in "\\|*`<":
        text = text.replace(sign, f"\\{sign}")
    return " ".join(text.split())


def _latex_lines(table: Table, caption: str) -> Iterator[str]:
    columns = len(table.header)
    yield "\\begin{table*}"
    yield f"\\caption{{{_escaped(table.title)} ({_escaped(caption)}).}}"
    yield "\\centering"
    yield f"\\begin{{tabular}}{{@{{}}l*{{{columns - 1}}}{{c}}@{{}}}}"
    yield "\\toprule"
    if table.groups:
        yield " & ".join(["", *(f"\\multicolumn{{{n}}}{{c}}{{{text}}}" for text, n in table.groups)]) + r" \\"
        first = 2
        for _, count in table.groups:
            yield f"\\cmidrule(lr){{{first}-{first + count - 1}}}"
            first += count
    yield _latex_row(table.header)
    for rows in (table.systems, table.fixed):
        if rows:
            yield "\\midrule"
        yield from map(_latex_row, rows)
    yield "\\bottomrule"
    yield "\\end{tabular}"
    yield "\\end{table*}"


def _latex_row(cells: tuple[str, ...]) -> str:
    return " & ".join(map(_escaped, cells)) + r" \\"


def _escaped(text: str) -> str:
    return "".join(_LATEX.get(sign, sign) for sign in " ".join(text.split()))
