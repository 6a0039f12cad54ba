"""`ogmkit evaluate --predictions` end to end on the repository's small dataset."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

FIXTURE = Path(__file__).resolve().parents[2] / "fixtures" / "nuscenes-synthetic"


def run(*arguments):
    return CliRunner().invoke(main, list(map(str, arguments)))


@pytest.fixture(scope="module")
def labels(tmp_path_factory):
    out = tmp_path_factory.mktemp("labels") / "out"
    result = run("extract", FIXTURE, out, "--definition", "lss", "--scenes", "scene-0001")
    assert result.exit_code == 0, result.output
    assert "labels  lss" in result.stdout
    assert "valid trajectories" not in result.stdout
    return out


@pytest.fixture(scope="module")
def grids(labels):
    """Grids as the labels, but for a row too few."""
    path = labels.parent / "grids.npz"
    with h5py.File(labels / "scene-0001.h5") as shard:
        vehicle = shard["SURROUND/labels/lss/vehicle"][:]
        vehicle[:, 100] = 0
        np.savez(path, sample_token=shard["SURROUND/sample_token"].asstr()[:].astype("U"), vehicle=vehicle)
    return path


def test_shards_of_labels_are_shown_and_sound(labels):
    assert "lss v1  SURROUND       20  vehicle" in run("inspect", labels / "scene-0001.h5").stdout
    assert run("verify", labels).stdout == f"{labels}: sound\n"


@pytest.mark.parametrize(
    "command", [("homography-fit",), ("preview", "--out", "OUT"), ("train", "lstm-ed", "--out", "OUT")]
)
def test_what_takes_cameras_frames_says_what_is_missing(labels, tmp_path, command):
    if command[0] == "train":
        pytest.importorskip("torch")
    arguments = [str(tmp_path / "out") if one == "OUT" else one for one in command]
    place = 2 if command[0] == "train" else 1
    result = run(*arguments[:place], labels, *arguments[place:])
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1].endswith(
        "holds labels alone; extract with --definition paper as well"
    )


def test_a_table_whose_rows_name_the_definition(labels, grids):
    result = run("evaluate", labels, "--definition", "lss", "--predictions", grids)
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("labels lss v1: 20 samples of 20; threshold 0.5")
    (row,) = [line.split() for line in result.stdout.splitlines() if line.startswith("grids.npz")]
    assert row[1:4] == ["lss", "v1", "vehicle"]
    assert 90 < float(row[4]) < 100


def test_rows_as_json(labels, grids):
    result = run("evaluate", labels, "--definition", "lss", "--predictions", grids, "--format", "json")
    (row,) = json.loads(result.stdout)
    assert (row["definition"], row["target"], row["frames"]) == ("lss", "vehicle", 20)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("--definition", "lss"), 2, "--definition lss needs --predictions"),
        (("--definition", "fiery", "--predictions", "GRIDS"), 1, "has no labels 'fiery', only lss"),
        (("RUN", "--definition", "lss", "--predictions", "GRIDS"), 1, "can't share a column with lss: "),
    ],
)
def test_what_is_refused_takes_one_line(labels, grids, arguments, code, said):
    named = {"GRIDS": grids, "RUN": labels}
    result = run("evaluate", labels, *(named.get(one, one) for one in arguments))
    assert result.exit_code == code
    assert said in result.stderr.splitlines()[-1]
