"""`ogmkit splits` on a small synthetic dataset."""

import json

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

from ogmkit.nuscenes.splits import read_split_file


def run(*arguments):
    return CliRunner().invoke(main, ["splits", *map(str, arguments)])


def test_it_shows_what_splits_hold_and_how_near_they_lie(tiny_dataroot):
    found = run(tiny_dataroot)

    assert (found.exit_code, found.stderr) == (0, "")
    lines = [line.split() for line in found.stdout.splitlines()]
    assert lines[0] == ["split", "scenes", "key", "frames", "night", "rain", "maps"]
    assert ["key", "frames", "of", "to", "those", "of", "within", "5", "m", "median"] in lines


def test_json_has_the_fields_that_help_lists(tiny_dataroot):
    found = json.loads(run(tiny_dataroot, "--near", 7, "--json").stdout)

    assert list(found) == ["near_m", "splits", "pairs", "left_out"]
    assert found["near_m"] == 7.0
    assert {tuple(one) for one in found["splits"]} == {("name", "scenes", "frames", "locations", "tags")}
    assert {tuple(one) for one in found["pairs"]} == {("of", "to", "frames", "near_share", "median_m")}


def test_what_it_makes_is_a_split_file(tiny_dataroot, tmp_path):
    out = tmp_path / "apart.json"
    made = run(tiny_dataroot, "--out", out, "--apart", 0, "--test-share", 0)

    assert made.exit_code == 0, made.stderr
    assert set(read_split_file(out)) == {"train", "val"}
    again = json.loads(run(tiny_dataroot, "--split-file", out, "--json").stdout)
    assert [one["name"] for one in again["splits"]] == ["train", "val"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--apart", "3"], "--apart needs --out."),
        (["--seed", "3"], "--seed needs --out."),
        (
            ["--out", "x.json", "--split-file", "{file}"],
            "--out makes splits of its own: leave out --split-file.",
        ),
        (["--out", "x.json", "--val-share", "0.6", "--test-share", "0.4"], "leave nothing to train"),
    ],
)
def test_options_without_a_meaning_are_refused(tiny_dataroot, tmp_path, arguments, message):
    (tmp_path / "splits.json").write_text("{}")
    found = run(tiny_dataroot, *(one.format(file=tmp_path / "splits.json") for one in arguments))

    assert found.exit_code != 0
    assert message in found.stderr
