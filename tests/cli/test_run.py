"""`ogmkit run`: what it shows, how it fails, and that a kill changes nothing."""

import json
import random
import re
import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.shards.manifest import read_manifest

pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")

LONG_S = 600
INTERRUPTED = (
    r"ogmkit: stopping after this (step|validation); press Ctrl-C again to quit now\n"
    r"ogmkit: interrupted; run the same command to resume\n"
)
FILE = """
data: {data}
out: out
extract: {{grid: {{m_per_cell: 0.5, rows: 80, columns: 60, ego_column: 34}}}}
homography_fit: {{methods: [surface]}}
render_footprints: {{scale: 1, sets: [surface]}}
train: {{{images}batch_size: 2, limit_frames: 4, max_steps: {steps}}}
{trained}
evaluate: {{samples: 1}}
"""
ALL = """
homography: {head: four-point}
footprints: {colour: 0.3, optimizer: adamw, checkpoint_every: 2}
baselines: [{system: footprints, masks: full-body}]
planners:
  [{system: lstm-ed, lr: 1e-2}, {system: mid-to-end, no_past: true}, {system: holistic, pool_cells: 48}]
"""


@pytest.fixture(scope="module")
def world(plan_shards):
    return read_manifest(plan_shards).dataroot


@pytest.fixture
def write(world, tmp_path, monkeypatch):
    """Write the file and go to its folder: `write(trained, steps)`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def write(trained, steps=1):
        seeing = ("homography:", "footprints:", "holistic", "end-to-end")
        images = (
            "encoder: tu-test_resnet, image_size: [64, 96], " if any(n in trained for n in seeing) else ""
        )
        Path("chain.yaml").write_text(FILE.format(data=world, steps=steps, trained=trained, images=images))

    return write


def run(*arguments):
    return CliRunner().invoke(main, ["run", "chain.yaml", *arguments])


def test_a_shared_setting_that_nothing_reads_is_told_and_redoes_nothing(write):
    write("planners: [lstm-ed]", steps=2)
    assert run().exit_code == 0
    text = Path("chain.yaml").read_text()
    Path("chain.yaml").write_text(text.replace("train: {", "train: {kl_weight: 2, "))
    plan = run("--plan")
    assert plan.stderr == "ogmkit: chain.yaml: train: no training here reads kl_weight; ignored\n"
    assert all(line.endswith("  up to date") for line in plan.stdout.splitlines()[1:])


def test_a_line_for_each_step_then_the_tables_and_where_things_are(write):
    write("planners: [lstm-ed]", steps=2)
    first = run()
    assert first.exit_code == 0, first.stderr
    lines = [line for line in first.stderr.splitlines() if re.match(r"\d/6 ", line)]
    patterns = [
        r"1/6 extract: [\d.]+ s; 2 scenes, 32 frames",
        r"2/6 homography-fit: [\d.]+ s; 2 shards",
        r"3/6 render-footprints surface: [\d.]+ s; 32 frames",
        r"4/6 train lstm-ed: [\d.]+ s; 2 steps, best ade \S+",
        r"5/6 evaluate planning: [\d.]+ s; 4 sequences",
        r"6/6 report: [\d.]+ s",
    ]
    assert len(lines) == len(patterns)
    for line, pattern in zip(lines, patterns, strict=True):
        assert re.fullmatch(pattern, line), line
    assert first.stdout.startswith(Path("out/tables/planning.txt").read_text())
    assert "constant-velocity" in first.stdout
    where, report = first.stdout.splitlines()[-2:]
    assert where.startswith("out: tables/, pictures/ (2 pictures)")
    assert report.startswith("out/report.html: ")
    again = run()
    assert again.stdout == first.stdout
    assert re.findall(r"\d/6 (.+): up to date", again.stderr) == [
        *("extract", "homography-fit", "render-footprints surface"),
        *("train lstm-ed", "evaluate planning", "report"),
    ]


def test_a_plan_says_what_would_be_done_and_why(write):
    write("planners: [lstm-ed, {system: lstm-ed, name: second}]")
    fresh = run("--plan")
    assert (fresh.exit_code, fresh.stderr) == (0, "")
    assert re.findall(r"^(train \S+) +to be done +not done yet", fresh.stdout, re.MULTILINE) == [
        "train lstm-ed",
        "train second",
    ]
    assert not Path("out").exists()
    assert run().exit_code == 0
    write("planners: [{system: lstm-ed, lr: 1e-2}]")
    changed = run("--plan").stdout
    assert re.search(r"^extract +up to date$", changed, re.MULTILINE)
    assert "to be done  lr is 0.01 here but 0.001 there" in changed
    assert "out/runs/second: not in the configuration; left as it is, and not evaluated" in changed
    assert Path("out/tables/planning.txt").read_text().count("second") > 1


def test_a_plan_as_json(write):
    write("planners: [lstm-ed]")
    result = run("--plan", "--json")
    assert (result.exit_code, result.stderr) == (0, "")
    held = json.loads(result.stdout)
    assert (held["out"], held["left"]) == ("out", [])
    assert held["steps"][0] == {"step": "extract", "state": "to be done", "reason": "not done yet"}
    names = ["extract", "homography-fit", "render-footprints surface", "train lstm-ed", "evaluate planning"]
    assert [step["step"] for step in held["steps"]] == [*names, "report"]
    assert {step["state"] for step in held["steps"]} == {"to be done"}
    assert run("--json").exit_code == 2


@pytest.mark.parametrize("planning", [["--plan"], []], ids=["plan", "run"])
@pytest.mark.parametrize(
    ("trained", "message"),
    [
        ("planners: [{system: lstm-ed, val_split: test}]", "train lstm-ed: split 'test' has no scene"),
        (
            "planners: [lstm-ed]\nscenes: [scene-7*]",
            "extract: .*: no scene matches 'scene-7.'; did you mean",
        ),
        ("homography: {cameras: [CAM_BACK]}", "train homography: camera CAM_BACK is not extracted"),
    ],
)
def test_what_no_step_can_get_is_told_before_anything_is_done(write, trained, message, planning):
    write(trained)
    result = run(*planning)
    assert (result.exit_code, result.stdout) == (1, "")
    assert re.match(f"ogmkit: error: {message}", result.stderr), result.stderr
    assert result.stderr.count("\n") == 1
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("trained", "message"),
    [
        ("planners: [lstm]", "chain.yaml: planners: 1: unknown system 'lstm'; did you mean lstm-ed?"),
        ("planers: [lstm-ed]", "chain.yaml: unknown setting 'planers'; did you mean planners?"),
        ("planners: [lstm-ed", "chain.yaml: not YAML"),
        ("homography: {lr: 1e3, epochs: 9}", "train homography: the loss is not finite"),
    ],
)
def test_bad_input_takes_one_line(write, trained, message, complaints):
    write(trained, steps=9)
    result = run()
    assert (result.exit_code, result.stdout) == (1, "")
    line = result.stderr.splitlines()[-1]
    assert line.startswith("ogmkit: error: ")
    assert message in line
    assert all(re.match(r"[\s\d]+/", one) for one in complaints(result.stderr).splitlines()[:-1])


def test_needs_the_extra_train(write, monkeypatch):
    write("planners: [lstm-ed]")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    result = run()
    assert result.exit_code == 1
    assert "pip install 'ogmkit[train]'" in result.stderr


@pytest.mark.slow
def test_ctrl_c_ends_cleanly_and_the_same_command_goes_on(write, tmp_path, start):
    write("planners: [{system: lstm-ed, epochs: 100000}]", steps=100_000)
    process = start("run", "chain.yaml", cwd=tmp_path)
    while not Path("out/runs/lstm-ed/best.ckpt").exists() and process.running():
        time.sleep(0.02)
    process.send(signal.SIGINT, group=False)
    code, errors = process.finish(LONG_S)
    assert code == 130
    assert re.fullmatch(INTERRUPTED, "".join(errors.splitlines(keepends=True)[-2:])), errors
    plan = run("--plan").stdout
    assert re.search(r"^train lstm-ed +to be done +was cut short$", plan, re.MULTILINE)
    assert Path("out/runs/lstm-ed/last.ckpt").exists()


@pytest.mark.slow
def test_killed_at_five_random_moments_it_ends_with_the_same_tables(write, tmp_path, monkeypatch, start):
    folders = [tmp_path / "whole", tmp_path / "cut"]
    for folder in folders:
        folder.mkdir()
        monkeypatch.chdir(folder)
        write(ALL, steps=4)
    whole, cut = folders
    began = time.monotonic()
    assert start("run", "chain.yaml", cwd=whole).finish(LONG_S)[0] == 0
    seconds = time.monotonic() - began
    chance = random.Random(0)
    codes = []
    for _ in range(5):
        process = start("run", "chain.yaml", cwd=cut)
        time.sleep(chance.uniform(0.1, 0.5) * seconds)
        process.send(signal.SIGKILL)
        codes.append(process.finish(LONG_S)[0])
    assert -signal.SIGKILL in codes
    code, errors = start("run", "chain.yaml", cwd=cut).finish(LONG_S)
    assert code == 0, errors
    files = sorted(path.relative_to(whole) for path in (whole / "out/tables").iterdir())
    assert len(files) == 10
    for file in files:
        assert (cut / file).read_bytes() == (whole / file).read_bytes(), file
    assert not list(cut.rglob("*.part"))
    again = start("run", "chain.yaml", cwd=cut)
    assert again.finish(LONG_S)[1].count("up to date") == len(errors.splitlines())
