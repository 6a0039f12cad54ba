"""`ogmkit report` end to end."""

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main


def run(*arguments):
    return CliRunner().invoke(main, ["report", *map(str, arguments)])


def test_it_writes_one_file_and_names_it(extracted, tmp_path, complaints):
    out = tmp_path / "report.html"
    result = run(extracted, "--out", out, "--frames", "1", "--no-check")
    assert (result.exit_code, result.stdout) == (0, f"{out}\n")
    assert complaints(result.stderr) == ""
    assert out.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--frames", "-1"], "--frames"),
        (["--examples", "many"], "--examples"),
        (["--dataroot", "nowhere"], "--dataroot"),
    ],
)
def test_wrong_options_are_usage_errors(extracted, tmp_path, arguments, words):
    result = run(extracted, "--out", tmp_path / "report.html", *arguments)
    assert result.exit_code == 2
    assert words in result.stderr


def test_something_else_is_refused_in_one_line(tmp_path, complaints):
    result = run(tmp_path, "--out", tmp_path / "report.html")
    assert result.exit_code == 1
    assert complaints(result.stderr).startswith(f"ogmkit: error: {tmp_path}: neither shards, a RUN")
    assert list(tmp_path.iterdir()) == []
