"""What is written can be read back."""

import csv
import io
import json
import math

import pytest

from ogmkit.evaluation.formats import as_csv, as_json, as_latex, as_markdown
from ogmkit.evaluation.report import explanations, heading, separation_table, tables
from ogmkit.evaluation.result import Evaluation, Figure, Separation
from ogmkit.grid import GridSpec

KEYS = ["system", "target", "view", "region", "cells", "iou", "value", "low", "high"]
COLUMNS = (("camera", "full"), ("bev", "full"), ("bev", "close"), ("bev", "far"))
SYSTEM, FIXED = "run_1&|50%", "all-drivable"


def figures(system, offset):
    """Values that tell where they belong: in %, offset + 10 for vehicles + 1 a column, + 0.5 for `mean`."""
    for t, target in enumerate(("drivable", "vehicles")):
        for c, (view, region) in enumerate(COLUMNS):
            for cells in ("all", "fov") if view == "bev" else ("all",):
                for iou in ("foreground", "mean"):
                    value = offset + 10 * t + c + 0.5 * (iou == "mean") + 0.2 * (cells == "fov")
                    value = math.nan if (system, view) == (FIXED, "camera") else value / 100
                    yield Figure(system, target, view, region, cells, iou, value, value - 0.01, value + 0.02)


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
        figures=(*figures(SYSTEM, 30), *figures(FIXED, 60)),
        separations=(
            Separation(SYSTEM, 40, 20, 0.5, 0.25, 0.75),
            Separation(FIXED, 40, 0, math.nan, math.nan, math.nan),
        ),
        notes=("a note",),
        samples=(),
    )


def test_json_is_one_flat_list_of_figures(evaluation):
    found = json.loads(as_json(evaluation))

    assert [list(record) for record in found] == [KEYS] * 56
    assert found[2] == {
        "system": SYSTEM,
        "target": "drivable",
        "view": "bev",
        "region": "full",
        "cells": "all",
        "iou": "foreground",
        "value": 0.31,
        "low": 0.31 - 0.01,
        "high": 0.31 + 0.02,
    }
    undefined = [record for record in found if (record["system"], record["view"]) == (FIXED, "camera")]
    assert [(one["value"], one["low"], one["high"]) for one in undefined] == [(None, None, None)] * 4


def test_csv_holds_the_same_figures(evaluation):
    found = list(csv.DictReader(io.StringIO(as_csv(evaluation))))
    expected = json.loads(as_json(evaluation))

    assert [list(record) for record in found] == [KEYS] * 56
    for one, two in zip(found, expected, strict=True):
        for key in KEYS:
            value = (float(one[key]) if one[key] else None) if key in ("value", "low", "high") else one[key]
            assert value == two[key]


def test_there_is_a_table_for_each_kind_of_iou_and_cells(evaluation):
    titles = [table.title for table in tables(evaluation)]

    assert titles == [
        "foreground IoU, all cells",
        "foreground IoU, cells in the field of view only",
        "mean of foreground and background IoU, all cells",
        "mean of foreground and background IoU, cells in the field of view only",
    ]


def test_tables_have_the_papers_columns(evaluation):
    foreground, in_view, _, mean_in_view = tables(evaluation)

    assert foreground.groups == (("drivable", 4), ("vehicles", 4))
    assert foreground.header == ("system", *("camera", "BEV full", "BEV close", "BEV far") * 2)
    expected = [
        f"{value:.1f} [{value - 1:.1f}–{value + 2:.1f}]" for value in (30, 31, 32, 33, 40, 41, 42, 43)
    ]
    assert foreground.systems == ((SYSTEM, *expected),)
    assert foreground.fixed[0][1:3] == ("NA", "61.0 [60.0–63.0]")
    assert [cell.split()[0] for cell in in_view.systems[0][1:4]] == ["30.0", "31.2", "32.2"]
    assert [cell.split()[0] for cell in mean_in_view.systems[0][1:4]] == ["30.5", "31.7", "32.7"]


def test_neighbours_have_a_table_of_their_own(evaluation):
    table = separation_table(evaluation)

    assert table.header == ("system", "pairs", "found", "told apart")
    assert table.systems == ((SYSTEM, "40", "20", "50.0 [25.0–75.0]"),)
    assert table.fixed == ((FIXED, "40", "0", "NA"),)


def test_the_heading_names_what_figures_rest_on(evaluation):
    assert heading(evaluation) == (
        "split val: 1,234 frames in 2 scenes, CAM_FRONT; homography network; threshold 0.5; "
        "1000 × 550 cells of 0.1 m; ceilings at 1:2"
    )
    assert explanations(evaluation)[1:] == ("a note",)


def test_markdown_is_tables_of_the_same_cells(evaluation):
    text = as_markdown(evaluation)
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [line.replace("\\|", "¦").strip("|").split("|") for line in lines]

    assert heading(evaluation) in text
    assert [len(row) for row in cells] == [9] * 16 + [4] * 4
    names = [cell.strip() for cell in cells[0]]
    assert names[1:3] == ["drivable camera", "drivable BEV full"]
    assert names[-1] == "vehicles BEV far"
    shown = [cell.strip().replace("\\", "").replace("¦", "|") for cell in cells[2]]
    assert tuple(shown) == tables(evaluation)[0].systems[0]
    assert cells[3][0].strip() == FIXED
    assert "- a note" in text


def test_latex_escapes_and_rules(evaluation):
    text = as_latex(evaluation)
    (first, *_), rows = text.split("\\end{table*}"), [line for line in text.splitlines() if " & " in line]
    body = [line for line in rows if line.startswith(("run", "all-"))]

    assert text.count("\\begin{tabular}") == text.count("\\bottomrule") == 5
    assert first.count("\\midrule") == 2  # one below the names, one above the fixed rows
    assert first.index("run\\_1") < first.rindex("\\midrule") < first.index("all-drivable")
    assert "\\cmidrule(lr){2-5}" in first
    assert "\\cmidrule(lr){6-9}" in first
    assert [line.replace("\\&", "").count("&") for line in body] == [8] * 8 + [3] * 2
    assert body[0].startswith("run\\_1\\&|50\\% & 30.0 [29.0--32.0] & ")
    assert all(line.endswith(r"\\") for line in body)
    assert not any(ord(sign) > 127 for sign in text if sign not in "–×")
    assert "–" not in "".join(body)
