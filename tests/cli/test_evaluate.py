"""`ogmkit evaluate`, with runs that need no torch."""

import csv
import io
import json
import re
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from ogmkit_cli import evaluate as module
from ogmkit_cli.evaluate import command
from ogmkit_cli.main import main

from ogmkit.evaluation.planning import evaluate as planning
from ogmkit.evaluation.planning.fixed import FIXED
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure, PlanSample
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.metrics.displacement import METRICS, READINGS
from ogmkit.metrics.plan import Plan
from ogmkit.shards.manifest import read_manifest

ROWS = ["all-drivable", "mean-map", "ceiling-surface", "ceiling-full-body"]


@pytest.fixture(scope="module")
def shards(tmp_path_factory, tiny_dataroot):
    """Shards with a homography; tests only read them."""
    folder = tmp_path_factory.mktemp("evaluate")
    grid = ["--cell-size", "0.5", "--rows", "120", "--columns", "60"]
    for arguments in (
        ["extract", tiny_dataroot, folder / "shards", *grid, "--cache-dir", folder / "cache"],
        ["homography-fit", folder / "shards", "--method", "surface"],
    ):
        result = CliRunner().invoke(main, [str(argument) for argument in arguments])
        assert result.exit_code == 0, result.output
    return folder / "shards"


@pytest.fixture
def runs(tmp_path, monkeypatch, shards):
    """Two RUN folders of one system that finds nothing."""
    grid = read_manifest(shards).settings.targets.grid

    def frames(index, homography, **how):
        for scene, camera, frame in map(index.place, range(len(index))):
            bev = np.zeros((2, *grid.shape), np.float32)
            yield SimpleNamespace(scene=scene, camera=camera, frame=frame, bev=bev, image=None)

    def open_run(path):
        outputs = {"planner": ("lstm-ed", "plan"), "homography": ("homography", "homography")}
        system, output = outputs.get(path.name, ("oft", "grids"))
        return SimpleNamespace(
            step_s=0.5,
            path=path,
            checkpoint=path / "best.ckpt",
            system=system,
            name=system,
            output=output,
            masks=None,
            thresholds=None,
            grid=grid,
            cameras=("CAM_FRONT",),
            frames=frames,
        )

    monkeypatch.setattr(module, "open_runs", lambda paths: [open_run(path) for path in paths])
    paths = tmp_path / "one", tmp_path / "two"
    for path in paths:
        path.mkdir()
    return paths


@pytest.fixture
def planners(tmp_path, monkeypatch, runs):
    """A RUN folder of a planner, whose evaluation is made up; `calls` are what it was evaluated with."""

    def evaluate_plans(shards, runs, settings, **options):
        planners.calls.append(
            {"shards": shards, "runs": [run.path for run in runs], **options, **vars(settings)}
        )
        (scene,) = (entry.scene for entry in read_manifest(shards).split("val"))
        plan = Plan(np.zeros((5, 2)), np.ones((5, 2)), np.zeros(5))
        names = tuple(run.path.name for run in runs)
        return PlanEvaluation(
            split="val",
            scenes=1,
            sequences=2,
            cameras=("CAM_FRONT",),
            systems=names,
            fixed=FIXED,
            figures=tuple(
                PlanFigure(name, metric, horizon_s, reading, 0.5, 0.25, 0.75)
                for name in (*names, *FIXED)
                for metric in METRICS
                for horizon_s in (0.5, 1.5, 2.5)
                for reading in READINGS
            ),
            notes=(),
            samples=tuple(
                PlanSample(name, (scene, "CAM_FRONT", 1), plan) for name in names * bool(settings.samples)
            ),
        )

    monkeypatch.setattr(planning, "evaluate_plans", evaluate_plans)
    path = tmp_path / "planner"
    path.mkdir()
    planners = SimpleNamespace(path=path, calls=[])
    return planners


def run(*arguments):
    return CliRunner().invoke(main, ["evaluate", *map(str, arguments)])


def test_runs_of_homographies_are_left_out_with_a_note(shards, runs, tmp_path, complaints):
    left = tmp_path / "homography"
    left.mkdir()
    alone, both = run(shards, runs[0]), run(shards, left, runs[0])

    assert both.exit_code == 0
    assert both.stdout == alone.stdout
    assert complaints(both.stderr) == (
        f"{left}: predicts homographies, which have no table; left out. `ogmkit predict homography {shards} "
        f"--checkpoint {left}` shows their errors\n"
    )


def test_the_options_have_the_librarys_defaults():
    defaults = {option.name: option.default for option in command.params}
    library = EvaluateSettings()
    for name in ("split", "threshold", "scale", "batch_size"):
        assert defaults[name] == getattr(library, name)
    assert library.samples == module.PICTURE_FRAMES


def test_the_table_stands_on_stdout_with_a_rule_over_the_fixed_rows(shards, runs, complaints):
    result = run(shards, *runs)

    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0].startswith(
        "split val: 8 frames in 1 scene, CAM_FRONT; homography surface; threshold 0.5; "
    )
    assert lines[3:5] == [
        "foreground IoU in %, all cells; `ogmkit evaluate --all` adds the mean of foreground and background",
        "  IoU, cells in the field of view only, and neighbouring vehicles told apart",
    ]
    groups, header, *table = lines[5:14]
    assert [line.split()[0] for line in table[:2]] == ["one", "two"]
    assert set(table[2]) == {"-"}
    assert [line.split()[0] for line in table[3:]] == ROWS
    assert re.fullmatch(" +-+ drivable -+  -+ vehicles -+", groups)
    assert header.split() == ["system", *["camera", "BEV", "full", "close", "far"] * 2]
    ends = {len(line) for line in (groups, header, *table)}
    assert len(ends) == 1  # numbers stand under each other
    assert lines[14] == ""
    assert any(line.startswith("no confidence intervals: ") for line in lines[14:])
    assert "IoU" not in "".join(lines[14:])


def test_a_checkpoint_that_was_chosen_on_the_reported_scenes_is_told(shards, runs, complaints):
    for path in runs:
        (path / "splits.json").write_text('{"train": ["scene-0001"], "val": ["scene-0002"]}')
    result = run(shards, *runs)

    told = " ".join(result.stdout.split())
    assert (
        "the best checkpoint was chosen on scenes that are reported here, which flatters one, two: " in told
    )
    records = json.loads(run(shards, *runs, "--format", "json").stdout)
    assert {one["system"] for one in records if one["chosen_on_reported"]} == {"one", "two"}
    assert "checkpoint" not in run(shards).stdout


def test_all_writes_the_other_tables_below(shards, runs):
    headline, everything = (run(shards, *runs, *more).stdout for more in ([], ["--all"]))

    assert "--all" not in everything
    titles = [
        "foreground IoU in %, all cells",
        "foreground IoU in %, cells in the field of view",
        "mean of foreground and background IoU in %, all cells",
        "mean of foreground and background IoU in %, cells in the field of view",
        "neighbouring vehicles (at most 10 m apart) told apart by connected components",
    ]
    assert [line for line in everything.splitlines() if line in titles] == titles
    first = headline.splitlines()[5:14]
    assert "\n".join([titles[0], *first]) in everything


def test_csv_and_json_hold_nothing_else_and_the_same(shards, runs, complaints):
    written = {form: run(shards, *runs, "--format", form) for form in ("csv", "json")}
    records = json.loads(written["json"].stdout)
    table = list(csv.DictReader(io.StringIO(written["csv"].stdout)))

    assert list(dict.fromkeys(one["system"] for one in records)) == ["one", "two", *ROWS]
    assert len(records) == len(table) == 6 * 45
    assert run(shards, *runs, "--format", "json", "--all").stdout == written["json"].stdout
    assert [one["value"] for one in table] == [
        "" if one["value"] is None else repr(one["value"]) for one in records
    ]
    assert not any(complaints(result.stderr) for result in written.values())


@pytest.mark.parametrize(
    ("form", "begins"), [("markdown", "**Evaluation**"), ("latex", "% needs \\usepackage")]
)
def test_other_formats(shards, form, begins):
    result, more = run(shards, "--format", form), run(shards, "--format", form, "--all")

    assert result.exit_code == more.exit_code == 0
    assert result.stdout.startswith(begins)
    assert result.stdout.count("close") < more.stdout.count("close")


def test_pictures_are_one_png_a_run_and_named_on_stderr(shards, runs, tmp_path, complaints):
    result = run(shards, *runs, "--pictures", tmp_path / "pictures", "--format", "json")

    assert result.exit_code == 0
    json.loads(result.stdout)
    written = [tmp_path / "pictures" / f"{name}.png" for name in ("one", "two")]
    assert complaints(result.stderr).splitlines() == [str(path) for path in written]
    assert sorted((tmp_path / "pictures").iterdir()) == written
    assert cv2.imread(str(written[0])).shape[1] > 1000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--split", "test"], "unknown split 'test'"),
        (["--homography", "network"], "run `ogmkit predict homography {shards} --checkpoint RUN`"),
        (["--camera", "CAM_BACK"], "CAM_BACK"),
        (["{runs[0]}", "{runs[0]}"], "{runs[0]}: is the same checkpoint as {runs[0]}; give it once"),
        (["{runs[0]}", "--pictures", "{shards}/pictures"], "holds nothing but shards"),
    ],
)
def test_bad_input_takes_one_line(shards, runs, arguments, message, complaints):
    places = {"shards": shards, "runs": runs}
    result = run(shards, *(argument.format(**places) for argument in arguments))

    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr.startswith("ogmkit: error: ")
    assert message.format(**places) in result.stderr
    assert complaints(result.stderr).count("\n") == 1


def test_help_explains_each_row_for_free_on_a_line_of_its_own():
    begins = {line.split()[0] for line in run("--help").stdout.splitlines() if line.split()}
    assert {"all-drivable", "mean-map", "mean-mask", "ceiling-SOURCE", "ceiling-full-body"} <= begins
    assert {*FIXED} <= begins


def test_planners_have_a_table_of_their_own(shards, planners, complaints):
    result = run(shards, planners.path)

    assert (result.exit_code, complaints(result.stderr)) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0] == "split val: 2 sequences in 1 scene, CAM_FRONT"
    assert lines[2].startswith(
        "displacement at the horizon, in metres; `ogmkit evaluate --all` adds the mean "
    )
    groups, header, *table = lines[4:12]
    assert re.fullmatch(" +-+ ADE -+  -+ L1 longitudinal -+  -+ L1 lateral -+", groups)
    assert header.split() == ["system", *["0.5", "s", "1.5", "s", "2.5", "s"] * 3]
    assert table[0].split() == ["planner", *["0.50"] * 9]
    assert set(table[1]) == {"-"}
    assert [line.split()[0] for line in table[2:]] == [*FIXED[1:]]
    assert len({len(line) for line in (groups, header, *table)}) == 1
    assert not any("IoU" in line for line in lines)


def test_planners_get_the_options_of_both_tables(shards, planners):
    options = ["--homography", "surface", "--camera", "CAM_FRONT", "--batch-size", 3, "--limit-frames", 7]
    assert run(shards, planners.path, *options).exit_code == 0

    (call,) = planners.calls
    call.pop("on_progress")
    assert call == {
        "shards": shards,
        "runs": [planners.path],
        "threshold": 0.5,
        "scale": 2.0,
        "samples": 0,
        "split": None,
        "split_file": None,
        "homography": "surface",
        "cameras": ("CAM_FRONT",),
        "batch_size": 3,
        "workers": 1,
        "limit": 7,
    }


@pytest.mark.parametrize("form", ["text", "markdown", "latex"])
def test_runs_of_both_stages_make_both_tables(shards, runs, planners, form):
    both = run(shards, planners.path, runs[0], "--format", form)
    apart = [run(shards, path, "--format", form).stdout for path in (runs[0], planners.path)]

    assert both.exit_code == 0
    assert both.stdout == "\n".join(apart)


@pytest.mark.parametrize("form", ["csv", "json"])
def test_a_file_holds_one_table(shards, runs, planners, form):
    result = run(shards, *runs, planners.path, "--format", form)

    assert (result.exit_code, result.stdout) == (2, "")
    assert "give runs that predict grids, or planners" in result.stderr
    assert not planners.calls
    assert "system" in run(shards, planners.path, "--format", form).stdout


def test_pictures_of_both_stages_lie_side_by_side(shards, runs, planners, tmp_path, complaints):
    result = run(shards, runs[0], planners.path, "--pictures", tmp_path / "pictures")

    assert result.exit_code == 0
    written = [tmp_path / "pictures" / name for name in ("oft.png", "planner-plans.png")]
    assert complaints(result.stderr).splitlines() == [str(path) for path in written]
    assert sorted((tmp_path / "pictures").iterdir()) == written


def test_usage_errors_exit_2(shards, runs, tmp_path):
    assert run(tmp_path / "absent").exit_code == 2
    assert run(shards, tmp_path / "absent").exit_code == 2
    assert run(shards, "--threshold", 1).exit_code == 2
    assert run(shards, "--format", "html").exit_code == 2
    assert run(shards, "--pictures", tmp_path).exit_code == 2
