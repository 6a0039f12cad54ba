"""The second table as text and as files."""

import csv
import io
import json
import math
from dataclasses import replace

import pytest

from ogmkit.evaluation.formats import as_csv, as_json, as_latex, as_markdown, report_of
from ogmkit.evaluation.planning.named import COLUMNS
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure
from ogmkit.metrics.displacement import METRICS, READINGS
from ogmkit.metrics.open_loop.catalogue import DEFINITIONS

KEYS = [
    *("system", "definition", "metric", "horizon_s", "reading", "value", "low", "high"),
    *("chosen_on_reported", "learnt_from_reported"),
]
SYSTEM, TRUTH, CONTROL = "holistic-np", "truth", "cubic"
NO_DISTRIBUTION = ("nll", "inside_50", "inside_90")


def figures(system, offset):
    """Values that tell where they belong: offset + a tenth a metric + 0.02 a horizon + 0.01 for `mean`."""
    for m, metric in enumerate(METRICS):
        for h, horizon_s in enumerate((0.5, 1.5, 2.5)):
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


@pytest.fixture
def one_scene(evaluation):
    """The same figures, of one scene."""
    figures = tuple(replace(one, low=math.nan, high=math.nan) for one in evaluation.figures)
    return replace(evaluation, scenes=1, figures=figures)


def test_json_is_one_flat_list_of_figures(evaluation):
    found = json.loads(as_json(evaluation))

    assert [list(record) for record in found] == [KEYS] * (3 * 48)
    assert found[3] == {
        "system": SYSTEM,
        "definition": "paper",
        "metric": "ade",
        "horizon_s": 1.5,
        "reading": "mean",
        "value": pytest.approx(-0.29),
        "low": pytest.approx(-0.39),
        "high": pytest.approx(-0.09),
        "chosen_on_reported": False,
        "learnt_from_reported": False,
    }
    undefined = [record for record in found if (record["system"], record["metric"]) == (TRUTH, "nll")]
    assert [(one["value"], one["low"], one["high"]) for one in undefined] == [(None, None, None)] * 6


def test_csv_holds_the_same_figures(evaluation):
    text = as_csv(evaluation)
    found, expected = list(csv.DictReader(io.StringIO(text))), json.loads(as_json(evaluation))

    assert text.startswith(f"{','.join(KEYS)}\n")
    for one, two in zip(found, expected, strict=True):
        for key in KEYS:
            number = key in ("horizon_s", "value", "low", "high")
            known = str(two[key]) if key.endswith("_reported") else two[key]
            assert ((float(one[key]) if one[key] else None) if number else one[key]) == known


def test_the_headline_is_displacements_at_the_horizons_without_intervals(evaluation):
    report = report_of(evaluation, all_tables=False)

    (table,) = report.tables
    assert table == report_of(evaluation).tables[0]
    assert table.title == "displacement at the horizon, in metres"
    assert table.groups == (("ADE", 3), ("L1 longitudinal", 3), ("L1 lateral", 3))
    assert table.header == ("system", *("0.5 s", "1.5 s", "2.5 s") * 3)
    assert [row[0] for row in table.systems] == [SYSTEM]
    shown = ("2.00", "2.02", "2.04", "2.10", "2.12", "2.14", "2.20", "2.22", "2.24")
    assert table.fixed == ((CONTROL, *shown),)  # the truth has no errors


def test_a_headline_says_what_all_tables_add(evaluation, one_scene):
    rest = (
        "the mean up to each horizon, how good the distributions are, what lies where plans lead, and "
        "scores by name"
    )

    assert report_of(evaluation, all_tables=False).hint == (
        f"`ogmkit evaluate --all` adds 95 % intervals, {rest}"
    )
    assert report_of(one_scene, all_tables=False).hint == f"`ogmkit evaluate --all` adds {rest}"
    assert report_of(evaluation).hint == ""


def test_all_tables_of_several_scenes_are_one_for_each_reading_and_error(evaluation):
    _, *tables, _, _ = report_of(evaluation).tables

    readings = (
        "displacement at the horizon, in metres [95 % interval]",
        "displacement, mean up to the horizon, in metres [95 % interval]",
    )
    assert [table.title for table in tables] == [
        f"{reading}: {error}" for reading in readings for error in ("ADE", "L1 longitudinal", "L1 lateral")
    ]
    assert {table.header for table in tables} == {("system", "0.5 s", "1.5 s", "2.5 s")}
    firsts = (2, 2.1, 2.2, 2.01, 2.11, 2.21)
    for table, first in zip(tables, firsts, strict=True):
        values = (first, first + 0.02, first + 0.04)
        shown = [f"{value:.2f} [{value - 0.1:.2f}–{value + 0.2:.2f}]" for value in values]
        assert table.fixed == ((CONTROL, *shown),)
        assert [row[0] for row in table.systems] == [SYSTEM]


def test_the_rest_has_tables_at_the_last_horizon(evaluation):
    *_, distributions, surroundings = report_of(evaluation).tables

    assert distributions.title == (
        "mean up to 2.5 s, NLL in nats, shares in % [95 % interval]: distributions"
    )
    assert distributions.header == ("system", "NLL", "inside 50 %", "inside 90 %")
    assert surroundings.header == ("system", "off drivable", "in vehicle")
    assert distributions.systems == ((SYSTEM, "0.03 [−0.07, 0.23]", "13.0 [3.0–33.0]", "23.0 [13.0–43.0]"),)
    assert surroundings.systems == ((SYSTEM, "33.0 [23.0–53.0]", "43.0 [33.0–63.0]"),)
    assert distributions.fixed == ((TRUTH, "NA", "NA", "NA"), (CONTROL, "NA", "NA", "NA"))
    assert surroundings.fixed[0] == (TRUTH, "65.0 [55.0–85.0]", "75.0 [65.0–95.0]")


def test_one_scene_has_no_intervals_and_fewer_tables(one_scene):
    at, mean, other = report_of(one_scene).tables

    assert (at.title, mean.title) == (
        "displacement at the horizon, in metres",
        "displacement, mean up to the horizon, in metres",
    )
    assert at.groups == mean.groups == (("ADE", 3), ("L1 longitudinal", 3), ("L1 lateral", 3))
    assert (at.fixed[0][1], mean.fixed[0][1]) == ("2.00", "2.01")
    assert other.groups == (("distributions", 3), ("surroundings", 2))
    assert other.systems == ((SYSTEM, "0.03", "13.0", "23.0", "33.0", "43.0"),)


def test_heading_and_explanations(evaluation, one_scene):
    report = report_of(evaluation)

    assert report.heading == "split val: 1,234 sequences in 2 scenes, CAM_FRONT"
    assert report.explanations[-1] == "a note"
    interval = "Intervals come from resampling scenes."
    assert interval in report.explanations
    assert interval not in report_of(one_scene).explanations
    headline = report_of(evaluation, all_tables=False).explanations
    assert not any(line == interval or line.startswith("NLL") for line in headline)


def test_markdown_and_latex_hold_all_tables(evaluation):
    markdown, latex = as_markdown(evaluation), as_latex(evaluation)
    rows = [line for line in markdown.splitlines() if line.startswith("|")]

    assert [row.count("|") for row in rows] == [11] * 4 + [5] * 24 + [5] * 5 + [4] * 5
    assert rows[0].startswith("| system | ADE 0.5 s | ADE 1.5 s | ")
    assert latex.count("\\begin{tabular}") == latex.count("\\bottomrule") == 9
    assert "inside 50 \\%" in latex
    assert "0.03 [$-$0.07, 0.23]" in latex
    assert not any(
        ord(sign) > 127 for line in latex.splitlines() if not line.startswith("%") for sign in line
    )


def named(system, offset, told):
    """Scores by name: offset + a tenth a column + 0.01 a horizon, without one at 3 s where it is told."""
    for c, (definition, metric) in enumerate(COLUMNS):
        for h, horizon_s in enumerate((1.0, 2.0, 3.0)):
            value = math.nan if told and h == 2 else offset + c / 10 + h / 100
            reading = DEFINITIONS[definition].reading
            figure = PlanFigure(system, metric, horizon_s, reading, value, value, value)
            yield replace(figure, definition=definition)


@pytest.fixture
def by_name(one_scene):
    rows = {SYSTEM: 1.0, CONTROL: 2.0, TRUTH: 0.0, "ego-status": 3.0}
    told = (SYSTEM, CONTROL)
    figures = tuple(one for name, offset in rows.items() for one in named(name, offset, name in told))
    return replace(one_scene, named=figures, untold=(TRUTH, "ego-status"))


def test_scores_by_name_are_tables_of_their_own_for_plans_told_and_not(by_name):
    *_, distances, cells, exact, untold, _, their_exact = report_of(by_name).tables

    assert distances.title == "plans told the point at 3 s: L2 in metres"
    assert distances.groups == (("uniad", 3), ("stp3, vad", 3))
    assert distances.header == ("system", "1 s", "2 s", "3 s", "to 1 s", "to 2 s", "to 3 s")
    assert distances.systems == ((SYSTEM, "1.00", "1.01", "–", "1.30", "1.31", "–"),)
    assert distances.fixed == ((CONTROL, "2.00", "2.01", "–", "2.30", "2.31", "–"),)
    assert cells.groups == (("uniad", 3), ("stp3", 3), ("vad", 3))
    assert cells.fixed[0][1:] == ("210.00", "211.00", "–", "240.00", "241.00", "–", "270.00", "271.00", "–")
    assert exact.groups == (("collision", 3), ("drivable edge", 3))
    assert untold.title == "plans not told it: L2 in metres"
    assert (untold.systems, untold.fixed) == (
        (),
        (("ego-status", "3.00", "3.01", "3.02", "3.30", "3.31", "3.32"),),
    )
    assert [row[0] for row in their_exact.fixed] == [TRUTH, "ego-status"]


def test_scores_by_name_come_with_their_faults_and_why_there_is_none(by_name):
    text = "\n".join(report_of(by_name).explanations)

    assert "–: a plan that is told the point at 3 s has none of its own there" in text
    for name, one in DEFINITIONS.items():
        assert name in text
        assert all(fault in text for fault in one.faults)
    assert "vad (" not in "\n".join(report_of(by_name, all_tables=False).explanations)


def test_the_headline_does_not_change_and_files_hold_scores_by_name(by_name, one_scene):
    assert report_of(by_name, all_tables=False).tables == report_of(one_scene, all_tables=False).tables

    found = json.loads(as_json(by_name))[len(by_name.figures) :]
    assert len(found) == 4 * len(COLUMNS) * 3
    assert list(found[0]) == KEYS
    assert {one["definition"] for one in found} == set(DEFINITIONS)
    assert [one["value"] for one in found if one["system"] == SYSTEM and one["horizon_s"] == 3.0] == [
        None
    ] * 11
