"""Every command and example of the pages runs: bash expands a page's lines, and each command runs here.

Trainings are two steps of a small network, and rasters are coarse. It takes minutes all the same: the gate
parses the commands' options, `make slow` runs them.
"""

import contextlib
import json
import os
import re
import subprocess
import sys
import textwrap
from glob import glob
from pathlib import Path

import click
import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.workflow.reading import read_config

ROOT = Path(__file__).resolve().parents[2]
PAGES = (
    ROOT / "README.md",
    ROOT / "DESCRIPTION.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").rglob("*.md")),
)
NAMES = [page.relative_to(ROOT).as_posix() for page in PAGES]
SMALL = {
    "extract": {"--cell-size": "1", "--rows": "100", "--columns": "55", "--cache-dir": "cache"},
    "train": {
        "--max-steps": "2",
        "--image-size": "64x96",
        "--encoder": "tu-test_resnet",
        "--channels": "8",
        "--batch-size": "2",
        "--limit-frames": "4",
        "--encoder-weights": "",
        "--checkpoint-gradients": "",
    },
    "": {"--workers": "0"},
}
"""Options that the test sets where a command has them, by command; "" is all. An empty value removes one."""
OTHERS = re.compile(r"(make |python|pip |\. |echo |_OGMKIT_COMPLETE=)")
"""Lines of blocks that call no command of ogmkit's."""
RUN_ELSEWHERE = ("README.md", "DESCRIPTION.md", "docs/first-hour.md", "docs/api.md", "docs/scaling.md")
"""Pages whose blocks of Python need a dataset: a test below, `make release-check`, tests/test_public.py.

Or a queue of SLURM's: nothing runs that block.
"""
SHELL = """
set -f
ogmkit() { printf '%s\\t' "$@"; printf '\\n'; }
"""


def blocks(page, language):
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def command_lines(block):
    """The arguments of each ogmkit command of a block, as bash passes them; file patterns stay."""
    lines = [line for line in block.splitlines() if not OTHERS.match(line)]
    script = SHELL + "\n".join(lines).replace(".venv/bin/ogmkit", "ogmkit")
    out = subprocess.run(["bash", "-euc", script], capture_output=True, text=True, check=True).stdout
    return [line.rstrip("\t").split("\t") for line in out.splitlines()]


def parsed_command(arguments):
    """The command that arguments call, and where its own arguments begin."""
    found, start = main.get_command(click.Context(main), arguments[0]), 1
    if isinstance(found, click.Group):
        found, start = found.get_command(click.Context(found), arguments[1]), 2
    return found, start


def small(arguments):
    """Arguments with patterns expanded and what makes the command quick."""
    found, start = parsed_command(arguments)
    known = {name for option in found.params for name in option.opts}
    if "--calibration" in arguments:
        known.discard("--workers")  # goes with shards only
    changes = {
        name: value for name, value in (SMALL.get(arguments[0], {}) | SMALL[""]).items() if name in known
    }
    kept = []
    for value in arguments[start:]:
        if kept and kept[-1] in changes and not value.startswith("--"):
            kept.pop()
        elif "*" in value:
            kept.extend(sorted(glob(value)))
        else:
            kept.append(value)
    kept = [value for value in kept if value not in changes]
    options = [text for name, value in changes.items() if value for text in (name, value)]
    return [*arguments[:start], *kept, *options]


def run_block(block):
    for arguments in command_lines(block):
        result = CliRunner().invoke(main, small(arguments))
        assert result.exit_code == 0, f"{arguments}\n{result.output}"


def make_world(folder, version="v1.0-mini"):
    settings = SynthesisSettings(
        2, 14, cameras=("CAM_FRONT",), image_size=(90, 160), lidar_azimuths=180, version=version
    )
    synthesize(folder, settings)


@pytest.mark.parametrize("page", NAMES)
def test_the_options_of_every_command_exist(page):
    for block in blocks(page, "sh"):
        for arguments in command_lines(block):
            found, start = parsed_command(arguments)
            found.make_parser(click.Context(found)).parse_args(arguments[start:])


@pytest.mark.parametrize("page", NAMES)
def test_every_block_says_its_language_and_can_be_read(page, tmp_path):
    text = (ROOT / page).read_text(encoding="utf-8")
    for language, block in re.findall(r"^ *```([^\n`]*)\n(.*?)^ *```", text, re.MULTILINE | re.DOTALL):
        assert language in ("sh", "python", "json", "yaml", "text"), f"{page}: {language!r}: {block}"
        match language:
            case "json":
                json.loads(block)
            case "python":
                compile(textwrap.dedent(block), page, "exec")
            case "yaml":
                pytest.importorskip("yaml", reason="PyYAML is not installed: pip install 'ogmkit[train]'")
                path = tmp_path / "run.yaml"
                path.write_text(block, encoding="utf-8")
                read_config(path)


@pytest.mark.parametrize(
    "page", [name for name in NAMES if blocks(name, " *python") and name not in RUN_ELSEWHERE]
)
def test_blocks_of_python_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in blocks(page, " *python"):
        exec(compile(textwrap.dedent(block), page, "exec"), names)


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    """A folder in which the blocks of docs/reproduce.md ran, on a synthetic dataset of 28 frames."""
    pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
    folder = tmp_path_factory.mktemp("reproduced")
    make_world(folder / "nuscenes", "v1.0-trainval")
    with contextlib.chdir(folder):
        for block in blocks("docs/reproduce.md", "sh"):
            run_block(block)
    return folder


@pytest.mark.slow
def test_reproducing_the_paper(reproduced):
    assert len(list((reproduced / "sheets").iterdir())) > 0
    assert len(list((reproduced / "runs").glob("*/best.ckpt"))) == 14


@pytest.fixture
def beside(reproduced, tmp_path, monkeypatch):
    """A new working folder that has the shards and runs of docs/reproduce.md."""
    for name in ("shards", "runs"):
        (tmp_path / name).symlink_to(reproduced / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def put_images(count):
    folder = Path("images")
    folder.mkdir(exist_ok=True)
    for number in range(1, count + 1):
        cv2.imwrite(str(folder / f"{number:04}.jpg"), np.full((900, 1600, 3), 90 + number, np.uint8))


@pytest.mark.slow
@pytest.mark.parametrize("calibration", [0, 1])
def test_predicting_grids(beside, calibration):
    put_images(2)
    Path("calibration.json").write_text(blocks("docs/predict.md", "json")[calibration])

    run_block(blocks("docs/predict.md", "sh")[0])

    assert (beside / "predictions/predictions.h5").exists()
    assert list((beside / "pictures").glob("*.png"))


@pytest.mark.slow
def test_predicting_plans(beside):
    put_images(6)
    Path("plan.json").write_text(blocks("docs/predict.md", "json")[2])

    run_block(blocks("docs/predict.md", "sh")[1])

    assert json.loads((beside / "plans.json").read_text())


@pytest.mark.slow
def test_reports(beside):
    run_block(blocks("docs/report.md", "sh")[0])

    assert "Examples of confusion" in (beside / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def readme_folder(tmp_path_factory):
    """A folder in which the README's commands on the user's data ran."""
    folder = tmp_path_factory.mktemp("readme")
    make_world(folder / "dataroot")
    with contextlib.chdir(folder):
        run_block(blocks("README.md", "sh")[1])
    return folder


@pytest.mark.slow
def test_the_readme_makes_targets(readme_folder):
    assert {"errors.png", "shards", "pictures", "report.html"} <= {
        path.name for path in readme_folder.iterdir()
    }


@pytest.mark.slow
def test_the_readme_trains(readme_folder, monkeypatch):
    pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
    monkeypatch.chdir(readme_folder)
    (readme_folder / "examples").symlink_to(ROOT / "examples")
    (readme_folder / "fixtures").symlink_to(ROOT / "fixtures")
    block = blocks("README.md", "sh")[2]
    assert block.count("ogmkit run examples/demo.yaml") == 1  # `make demo` runs it

    run_block(block.replace("demo.yaml", "demo.yaml --plan"))

    assert list((readme_folder / "sheets").iterdir())


def test_bash_completes_commands_after_the_lines_of_the_first_hour(tmp_path):
    (block,) = (block for block in blocks("docs/first-hour.md", "sh") if "COMPLETE" in block)
    asked = "COMP_WORDS=(ogmkit render-f); COMP_CWORD=1; _ogmkit_completion ogmkit; echo ${COMPREPLY[@]}"
    environment = os.environ | {
        "HOME": str(tmp_path),
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
    }

    done = subprocess.run(
        ["bash", "-euc", f"{block}\n. ~/.bashrc\n{asked}"],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.split() == ["render-footprints"]


def test_targets_of_make_exist():
    named = re.findall(r"(?:^|`)make ([a-z-]+)", "\n".join(path.read_text() for path in PAGES), re.MULTILINE)
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)

    assert named
    assert set(named) <= set(targets)


@pytest.mark.slow
def test_the_readmes_example_opens_a_shard_in_six_lines_of_h5py(readme_folder):
    (example,) = blocks("README.md", "python")
    assert len([line for line in example.splitlines() if line]) <= 6

    code = example.replace("demo/shards", str(readme_folder / "shards"))
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.startswith("(100, 55)")


def test_no_block_is_left_out():
    """What runs is picked by its number: a page with a new block needs a look at the tests above."""
    counts = [len(blocks(page, "sh")) for page in ("README.md", "docs/predict.md", "docs/report.md")]
    assert [*counts, len(blocks("docs/predict.md", "json"))] == [3, 2, 1, 3]
