"""The second table as text and as files."""

import csv
import io
import json
import math

import pytest

from ogmkit.evaluation.formats import as_csv, as_json, as_latex, as_markdown, report_of
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure
from ogmkit.metrics.displacement import HORIZONS_S, METRICS, READINGS

KEYS = ["system", "metric", "horizon_s", "reading", "value", "low", "high"]
SYSTEM, TRUTH, CONTROL = "holistic-np", "truth", "cubic"
NO_DISTRIBUTION = ("nll", "inside_50", "inside_90")


def figures(system, offset):
    """Values that tell where they belong: offset + a tenth a metric + 0.02 a horizon + 0.01 for `mean`."""
    for m, metric in enumerate(METRICS):
        for h, horizon_s in enumerate(HORIZONS_S):
            for r, reading in enumerate(READINGS):
                value = offset + m / 10 + h / 50 + r / 100
                if system != SYSTEM and metric in NO_DISTRIBUTION:
                    value = math.nan
                yield PlanFigure(system, metric, horizon_s, reading, value, value - 0.1, value + 0.2)


@pytest.fixture
def evaluation():
    return PlanEvaluation(
        split="val",
        scenes=2,
        sequences=1234,
        cameras=("CAM_FRONT",),
        systems=(SYSTEM,),
        fixed=(TRUTH, CONTROL),
        figures=(*figures(SYSTEM, -0.32), *figures(TRUTH, 0), *figures(CONTROL, 2)),
        notes=("a note",),
        samples=(),
    )


def test_json_is_one_flat_list_of_figures(evaluation):
    found = json.loads(as_json(evaluation))

    assert [list(record) for record in found] == [KEYS] * (3 * 48)
    assert found[3] == {
        "system": SYSTEM,
        "metric": "ade",
        "horizon_s": 1.5,
        "reading": "mean",
        "value": pytest.approx(-0.29),
        "low": pytest.approx(-0.39),
        "high": pytest.approx(-0.09),
    }
    undefined = [record for record in found if (record["system"], record["metric"]) == (TRUTH, "nll")]
    assert [(one["value"], one["low"], one["high"]) for one in undefined] == [(None, None, None)] * 6


def test_csv_holds_the_same_figures(evaluation):
    text = as_csv(evaluation)
    found, expected = list(csv.DictReader(io.StringIO(text))), json.loads(as_json(evaluation))

    assert text.startswith("system,metric,horizon_s,reading,value,low,high\n")
    for one, two in zip(found, expected, strict=True):
        for key in KEYS:
            number = key in ("horizon_s", "value", "low", "high")
            assert ((float(one[key]) if one[key] else None) if number else one[key]) == two[key]


def test_displacements_have_the_papers_columns_once_a_reading(evaluation):
    at, mean, _ = report_of(evaluation).tables

    assert (at.title, mean.title) == (
        "displacement at the horizon, in metres",
        "displacement, mean up to the horizon, in metres",
    )
    assert at.groups == mean.groups == (("ADE", 3), ("L1 longitudinal", 3), ("L1 lateral", 3))
    assert at.header == ("system", *("0.5 s", "1.5 s", "2.5 s") * 3)
    first = [2, 2.02, 2.04, 2.1, 2.12, 2.14, 2.2, 2.22, 2.24]
    for table, more in ((at, 0), (mean, 0.01)):
        shown = [f"{v + more:.2f} [{v + more - 0.1:.2f}–{v + more + 0.2:.2f}]" for v in first]
        assert table.fixed == ((CONTROL, *shown),)  # the truth has no errors
        assert [row[0] for row in table.systems] == [SYSTEM]


def test_the_rest_has_a_table_at_the_last_horizon(evaluation):
    table = report_of(evaluation).tables[2]

    assert table.header == ("system", "NLL", "inside 50 %", "inside 90 %", "off drivable", "in vehicle")
    assert table.systems[0][1:] == (
        "0.03 [−0.07, 0.23]",
        "13.0 [3.0–33.0]",
        "23.0 [13.0–43.0]",
        "33.0 [23.0–53.0]",
        "43.0 [33.0–63.0]",
    )
    assert [row[:4] for row in table.fixed] == [(name, "NA", "NA", "NA") for name in (TRUTH, CONTROL)]
    assert table.fixed[0][4:] == ("65.0 [55.0–85.0]", "75.0 [65.0–95.0]")


def test_heading_and_explanations(evaluation):
    report = report_of(evaluation)

    assert report.heading == "split val: 1,234 sequences in 2 scenes, CAM_FRONT"
    assert report.explanations[-1] == "a note"


def test_markdown_and_latex_hold_all_tables(evaluation):
    markdown, latex = as_markdown(evaluation), as_latex(evaluation)
    rows = [line for line in markdown.splitlines() if line.startswith("|")]

    assert [row.count("|") for row in rows] == [11] * 8 + [7] * 5
    assert rows[0].startswith("| system | ADE 0.5 s | ADE 1.5 s | ")
    assert latex.count("\\begin{tabular}") == latex.count("\\bottomrule") == 3
    assert "inside 50 \\%" in latex
    assert "0.03 [$-$0.07, 0.23]" in latex
    assert not any(
        ord(sign) > 127 for line in latex.splitlines() if not line.startswith("%") for sign in line
    )
