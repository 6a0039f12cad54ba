"""`ogmkit compare-labels` end to end on the repository's small dataset."""

import json
from pathlib import Path

import cv2
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

FIXTURE = Path(__file__).resolve().parents[2] / "fixtures" / "nuscenes-synthetic"


def run(*arguments):
    return CliRunner().invoke(main, ["compare-labels", *map(str, arguments)])


def test_a_table_and_a_picture(tmp_path):
    picture = tmp_path / "labels.png"
    result = run(
        FIXTURE,
        "--definition",
        "lss",
        "--definition",
        "bevfusion",
        "--scenes",
        "scene-0001",
        "--picture",
        picture,
    )

    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0] == "20 key frames; area: cells / beside's"
    (vehicles,) = [line.split() for line in lines if line.startswith("lss  ")]
    assert vehicles[:3] == ["lss", "exact", "vehicle"]
    assert float(vehicles[5]) == pytest.approx(
        int(vehicles[3].replace(",", "")) / int(vehicles[4].replace(",", "")), abs=1e-3
    )
    assert "lss and bevfusion have no cells in common" in lines
    assert cv2.imread(str(picture)).shape[1] > 600


def test_rows_as_json():
    result = run(FIXTURE, "--definition", "lss,cvt", "--no-map", "--scenes", "scene-0002", "--json")
    found = json.loads(result.stdout)
    assert (found["frames"], found["apart"]) == (20, [])
    assert {(row["one"], row["other"]) for row in found["rows"]} == {
        ("lss", "exact"),
        ("cvt", "exact"),
        ("lss", "cvt"),
    }


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--definition", "ls"), "'ls' is not one of paper, surround,"),
        (("--definition", "bevfusion", "--no-map"), "bevfusion: has no class without a map; leave it out"),
        (("--definition", "lss,lss"), "definitions: lss, lss: name at least one, each once"),
    ],
)
def test_what_cant_be_compared(arguments, said):
    result = run(FIXTURE, "--scenes", "scene-0001", *arguments)
    assert result.exit_code != 0
    assert said in result.output
