"""What is written can be read back."""

import csv
import io
import json
import math
from dataclasses import replace

import pytest

from ogmkit.evaluation.formats import as_csv, as_json, as_latex, as_markdown, report_of
from ogmkit.evaluation.report import heading
from ogmkit.evaluation.result import Evaluation, Figure
from ogmkit.grid import GridSpec

KEYS = [
    *("system", "definition", "target", "view", "region", "cells", "metric", "value", "low", "high"),
    *("chosen_on_reported", "learnt_from_reported"),
]
COLUMNS = (("camera", "full"), ("bev", "full"), ("bev", "close"), ("bev", "far"))
IOU_NAMES = ("foreground IoU", "mean of foreground and background IoU")
CELL_NAMES = ("all cells", "cells in the field of view")
SYSTEM, FIXED = "run_1&|50%", "all-drivable"


def figures(system, offset):
    """IoUs that tell where they belong: in %, offset + 10 for vehicles + 1 a column, + 0.5 for the mean."""
    for t, target in enumerate(("drivable", "vehicles")):
        for c, (view, region) in enumerate(COLUMNS):
            for cells in ("all", "fov") if view == "bev" else ("all",):
                for metric in ("foreground_iou", "mean_iou", "tuned_iou"):
                    value = offset + 10 * t + c + 0.5 * (metric == "mean_iou") + 0.2 * (cells == "fov")
                    missing = (system, view) == (FIXED, "camera") or metric == "tuned_iou"
                    value = math.nan if missing else value / 100
                    names = system, target, view, region, cells, metric
                    yield Figure(*names, value, value - 0.01, value + 0.02)


def pairs(system, found, *separated):
    """Figures of 40 neighbouring vehicles."""
    nothing = math.nan, math.nan
    for metric, values in (
        ("pairs", (40.0, *nothing)),
        ("pairs_found", (found, *nothing)),
        ("pairs_separated", separated),
    ):
        yield Figure(system, "vehicles", "bev", "full", "fov", metric, *values)


@pytest.fixture
def evaluation():
    return Evaluation(
        split="val",
        scenes=2,
        frames=1234,
        cameras=("CAM_FRONT",),
        grid=GridSpec(),
        homography="network",
        threshold=0.5,
        scale=2.0,
        systems=(SYSTEM,),
        fixed=(FIXED,),
        figures=(
            *(*figures(SYSTEM, 30), *pairs(SYSTEM, 20.0, 0.5, 0.25, 0.75)),
            *(*figures(FIXED, 60), *pairs(FIXED, 0.0, math.nan, math.nan, math.nan)),
        ),
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

    assert [list(record) for record in found] == [KEYS] * 90
    assert found[3] == {
        "system": SYSTEM,
        "definition": "paper",
        "target": "drivable",
        "view": "bev",
        "region": "full",
        "cells": "all",
        "metric": "foreground_iou",
        "value": 0.31,
        "low": 0.31 - 0.01,
        "high": 0.31 + 0.02,
        "chosen_on_reported": False,
        "learnt_from_reported": False,
    }
    undefined = [record for record in found if (record["system"], record["view"]) == (FIXED, "camera")]
    assert [(one["value"], one["low"], one["high"]) for one in undefined] == [(None, None, None)] * 6
    assert [(one["metric"], one["value"], one["low"]) for one in found[42:45]] == [
        ("pairs", 40.0, None),
        ("pairs_found", 20.0, None),
        ("pairs_separated", 0.5, 0.25),
    ]
    assert {one["definition"] for one in found} == {"paper"}


def test_csv_holds_the_same_figures(evaluation):
    found = list(csv.DictReader(io.StringIO(as_csv(evaluation))))
    expected = json.loads(as_json(evaluation))

    assert [list(record) for record in found] == [KEYS] * 90
    for one, two in zip(found, expected, strict=True):
        for key in KEYS:
            value = (float(one[key]) if one[key] else None) if key in ("value", "low", "high") else one[key]
            assert value == (str(two[key]) if key.endswith("_reported") else two[key])


@pytest.mark.parametrize("sign", "=+-@\t")
def test_text_that_a_spreadsheet_would_run_is_marked_as_text(evaluation, sign):
    name = f"{sign}cmd|'/c calc'!A1"
    figure = replace(evaluation.figures[0], system=name, value=-0.5)
    (found,) = csv.DictReader(io.StringIO(as_csv(replace(evaluation, figures=(figure,))), newline=""))

    assert (found["system"], found["value"]) == (f"'{name}", "-0.5")


def test_the_headline_is_the_foreground_over_all_cells_without_intervals(evaluation):
    report = report_of(evaluation, all_tables=False)

    (table,) = report.tables
    assert table == report_of(evaluation).tables[0]
    assert table.title == "foreground IoU in %, all cells"
    assert table.groups == (("drivable", 4), ("vehicles", 4))
    assert table.header == ("system", *("camera", "BEV full", "close", "far") * 2)
    assert table.systems == ((SYSTEM, "30.0", "31.0", "32.0", "33.0", "40.0", "41.0", "42.0", "43.0"),)
    assert table.fixed == ((FIXED, "NA", "61.0", "62.0", "63.0", "NA", "71.0", "72.0", "73.0"),)


def test_a_run_s_own_thresholds_have_a_row_beneath_it(evaluation):
    tuned = [
        replace(one, value=0.5) if (one.system, one.metric) == (SYSTEM, "tuned_iou") else one
        for one in evaluation.figures
    ]
    report = report_of(replace(evaluation, figures=tuple(tuned)), all_tables=False)

    plain, own = report.tables[0].systems
    assert (plain,) == report_of(evaluation, all_tables=False).tables[0].systems
    assert own == (f"{SYSTEM}, own thresholds", *["50.0"] * 8)
    assert [row[0] for row in report.tables[0].fixed] == [FIXED]
    assert any("own thresholds" in line for line in report.explanations)


def test_a_headline_says_what_all_tables_add(evaluation, one_scene):
    rest = (
        "the mean of foreground and background IoU, cells in the field of view only, and neighbouring "
        "vehicles told apart"
    )
    assert report_of(evaluation, all_tables=False).hint == (
        f"`ogmkit evaluate --all` adds 95 % intervals, {rest}"
    )
    assert report_of(one_scene, all_tables=False).hint == f"`ogmkit evaluate --all` adds {rest}"
    assert report_of(evaluation).hint == ""


def test_all_tables_of_several_scenes_are_one_for_each_reading_and_target(evaluation):
    _, *tables, neighbours = report_of(evaluation).tables

    readings = [f"{iou} in % [95 % interval], {cells}" for iou in IOU_NAMES for cells in CELL_NAMES]
    assert [table.title for table in tables] == [
        f"{reading}: {target}" for reading in readings for target in ("drivable", "vehicles")
    ]
    assert {(table.groups, table.header) for table in tables} == {
        ((), ("system", "camera", "BEV full", "close", "far"))
    }
    drivable, vehicles = (
        [f"{value:.1f} [{value - 1:.1f}–{value + 2:.1f}]" for value in values]
        for values in ((30, 31, 32, 33), (40, 41, 42, 43))
    )
    assert tables[0].systems == ((SYSTEM, *drivable),)
    assert tables[1].systems == ((SYSTEM, *vehicles),)
    assert tables[0].fixed[0][1:3] == ("NA", "61.0 [60.0–63.0]")
    assert [cell.split()[0] for cell in tables[2].systems[0][1:]] == ["30.0", "31.2", "32.2", "33.2"]
    assert [cell.split()[0] for cell in tables[7].systems[0][1:]] == ["40.5", "41.7", "42.7", "43.7"]
    assert neighbours.header == ("system", "pairs", "found", "told apart, in % of found [95 % interval]")
    assert neighbours.systems == ((SYSTEM, "40", "20", "50.0 [25.0–75.0]"),)
    assert neighbours.fixed == ((FIXED, "40", "0", "NA"),)


def test_one_scene_has_no_intervals_and_its_targets_share_tables(one_scene):
    *tables, neighbours = report_of(one_scene).tables

    assert [table.title for table in tables] == [
        f"{iou} in %, {cells}" for iou in IOU_NAMES for cells in CELL_NAMES
    ]
    assert [table.systems[0][1] for table in tables] == ["30.0", "30.0", "30.5", "30.5"]
    assert neighbours.systems == ((SYSTEM, "40", "20", "50.0"),)
    assert not any("Intervals" in line for line in report_of(one_scene).explanations)


def test_the_heading_names_what_figures_rest_on(evaluation):
    assert heading(evaluation) == (
        "split val: 1,234 frames in 2 scenes, CAM_FRONT; homography network; threshold 0.5; "
        "1000 × 550 cells of 0.1 m; ceilings at 1:2"
    )
    assert report_of(evaluation).explanations[1:] == ("Intervals come from resampling scenes.", "a note")
    assert report_of(evaluation, all_tables=False).explanations[1:] == ("a note",)


def test_markdown_is_tables_of_the_same_cells(evaluation):
    text = as_markdown(evaluation)
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [line.replace("\\|", "¦").strip("|").split("|") for line in lines]

    assert heading(evaluation) in text
    assert [len(row) for row in cells] == [9] * 4 + [5] * 32 + [4] * 4
    names = [cell.strip() for cell in cells[0]]
    assert names[1:3] == ["drivable camera", "drivable BEV full"]
    assert names[-1] == "vehicles far"
    shown = [cell.strip().replace("\\", "").replace("¦", "|") for cell in cells[2]]
    assert tuple(shown) == report_of(evaluation).tables[0].systems[0]
    assert cells[3][0].strip() == FIXED
    assert "- a note" in text
    assert "--all" not in text


def test_a_headline_can_stand_alone_in_a_document(evaluation):
    markdown, latex = (write(evaluation, all_tables=False) for write in (as_markdown, as_latex))

    assert markdown.count("| --- |") == latex.count("\\begin{tabular}") == 1
    hint = report_of(evaluation, all_tables=False).hint
    assert f"\n- {hint}.\n- close: " in markdown
    assert f"\n% {hint}\n" in latex


def test_latex_escapes_and_rules(evaluation):
    text = as_latex(evaluation)
    (first, *_), rows = text.split("\\end{table*}"), [line for line in text.splitlines() if " & " in line]
    body = [line for line in rows if line.startswith(("run", "all-"))]

    assert text.count("\\begin{tabular}") == text.count("\\bottomrule") == 10
    assert first.count("\\midrule") == 2  # one below the names, one above the fixed rows
    assert first.index("run\\_1") < first.rindex("\\midrule") < first.index("all-drivable")
    assert "\\cmidrule(lr){2-5}" in first
    assert "\\cmidrule(lr){6-9}" in first
    assert [line.replace("\\&", "").count("&") for line in body] == [8] * 2 + [4] * 16 + [3] * 2
    assert body[2].startswith("run\\_1\\&|50\\% & 30.0 [29.0--32.0] & ")
    assert all(line.endswith(r"\\") for line in body)
    assert not any(ord(sign) > 127 for sign in text if sign not in "–×")
    assert "–" not in "".join(body)
