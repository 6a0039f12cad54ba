"""The tables of `ogmkit evaluate` fit terminals."""

import math
from dataclasses import replace

import pytest
from ogmkit_cli.evaluate_text import WIDTH, report_text

from ogmkit.evaluation.formats import report_of
from ogmkit.evaluation.planning.fixed import FIXED
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure
from ogmkit.evaluation.result import Evaluation, Figure
from ogmkit.evaluation.tables import Report, Table
from ogmkit.grid import GridSpec
from ogmkit.metrics.displacement import METRICS, READINGS

LONG = "experiments/2024-05-01-footprints-resnet101-all-cameras-with-colour-and-crop/second-try-of-three"
RUNS = ("footprints", LONG, f"/home/somebody/projects/{LONG}/checkpoints/best.ckpt")
ROWS = ("all-drivable", "mean-map", "ceiling-calibration", "ceiling-four-point", "ceiling-full-body")
PLACES = [
    ("camera", "full", "all"),
    *(("bev", r, c) for r in ("full", "close", "far") for c in ("all", "fov")),
]


def grids(scenes):
    """The widest figures that can be, 100 %, and long names of runs."""
    low, high = (0.999, 1.0) if scenes > 1 else (math.nan, math.nan)
    figures = [
        Figure(system, target, *place, metric, 1.0, low, high)
        for system in (*RUNS, *ROWS)
        for target in ("drivable", "vehicles")
        for place in PLACES
        for metric in ("foreground_iou", "mean_iou")
    ]
    figures += [
        Figure(system, "vehicles", "bev", "full", "fov", metric, value, low, high)
        for system in (*RUNS, *ROWS)
        for metric, value in (("pairs", 123456.0), ("pairs_found", 12345.0), ("pairs_separated", 1.0))
    ]
    return Evaluation(
        split="val",
        scenes=scenes,
        frames=6019 * 6,
        cameras=tuple(f"CAM_{side}" for side in ("BACK", "BACK_LEFT", "BACK_RIGHT", "FRONT", "FRONT_LEFT")),
        grid=GridSpec(),
        homography="network",
        threshold=0.5,
        scale=2.0,
        systems=RUNS,
        fixed=ROWS,
        figures=tuple(figures),
        notes=(f"footprints: {LONG}, trained on masks 'network', and compared with them in camera view",),
        samples=(),
    )


def plans(scenes):
    """Tens of metres and likelihoods of a network that has learnt nothing."""
    figures = tuple(
        PlanFigure(system, metric, horizon_s, reading, -123.456, -150.5, -100.25)
        if metric == "nll"
        else PlanFigure(system, metric, horizon_s, reading, 1.0, 0.99, 1.0)
        if metric in METRICS[4:]
        else PlanFigure(system, metric, horizon_s, reading, 34.567, 28.25, 41.125)
        for system in (*RUNS, *FIXED)
        for metric in METRICS
        for horizon_s in (0.5, 1.5, 2.5)
        for reading in READINGS
    )
    if scenes == 1:
        figures = tuple(replace(one, low=math.nan, high=math.nan) for one in figures)
    return PlanEvaluation(
        split="val",
        scenes=scenes,
        sequences=3869,
        cameras=("CAM_FRONT",),
        systems=RUNS,
        fixed=FIXED,
        figures=figures,
        notes=(f"footprints: {LONG}, masks warped by homography network",),
        samples=(),
    )


@pytest.mark.parametrize("scenes", [1, 150])
@pytest.mark.parametrize("all_tables", [False, True])
@pytest.mark.parametrize("made", [grids, plans])
def test_no_line_is_wider_than_100_characters(made, all_tables, scenes):
    report = report_of(made(scenes), all_tables)
    text = report_text(report)

    assert WIDTH == 100
    assert max(map(len, text.splitlines())) <= 100
    wide = any("[" in cell for table in report.tables for row in table.systems for cell in row[1:])
    assert wide == (all_tables and scenes > 1)


@pytest.mark.parametrize("made", [grids, plans])
def test_the_headline_is_one_table(made):
    lines = report_text(report_of(made(150), all_tables=False)).splitlines()

    assert sum(line.startswith("system") for line in lines) == 1
    assert sum(line == "-" * len(line) for line in lines if line) == 1  # the rule over the fixed rows


def test_a_name_that_is_too_long_goes_on_below_its_figures():
    name = "runs/" + "abcdefgh" * 12
    table = Table("title", (), ("system", "figure"), ((name, "1.5"), ("short", "22.5")), (("free", "NA"),))
    text = report_text(Report("heading", (table,), "", ("a note",)))

    # 100 characters less two spaces and the six of `figure` leave 92 for names.
    assert text.splitlines() == [
        "heading",
        "",
        "title",
        f"{'system':<92}  figure",
        f"{name[:92]}     1.5",
        f"  {name[92:]}",
        f"{'short':<92}    22.5",
        "-" * 100,
        f"{'free':<92}      NA",
        "",
        "a note",
    ]


def test_figures_of_any_size_leave_names_readable():
    table = Table("title", (), ("system", "figure"), (("a-run-of-mine", "9" * 120),), ())
    lines = report_text(Report("heading", (table,), "", ())).splitlines()

    assert lines[4:6] == [f"a-run-of-     {'9' * 120}", "  mine"]


def test_prose_is_broken_but_paths_are_whole():
    path = "/home/somebody/" + "long-folder-name/" * 8
    text = report_text(Report("heading", (), "", (f"run: {path}, trained on masks",)))

    assert text.splitlines()[2:] == ["run:", f"  {path},", "  trained on masks"]
