"""What all commands share: examples, environment variables, log lines, paths with `~`, worker processes."""

import logging
import shlex

import click
import pytest
from click.testing import CliRunner
from ogmkit_cli.command import Command
from ogmkit_cli.logs import LOG
from ogmkit_cli.main import main
from ogmkit_cli.paths import UserPath

from ogmkit import __version__


def below(group, path):
    """The group and all commands and groups below it: (words, command)."""
    yield path, group
    if isinstance(group, click.Group):
        context = click.Context(group)
        for name in group.list_commands(context):
            yield from below(group.get_command(context, name), (*path, name))


ALL = list(below(main, ()))
LEAVES = [(path, command) for path, command in ALL if not isinstance(command, click.Group)]
of_all = pytest.mark.parametrize(("path", "command"), ALL, ids=[" ".join(path) for path, _ in ALL])
of_leaves = pytest.mark.parametrize(("path", "command"), LEAVES, ids=[" ".join(path) for path, _ in LEAVES])


def option(command, flag):
    return next(one for one in command.params if flag in one.opts)


@of_all
def test_every_help_ends_in_two_examples_of_that_command(path, command):
    text = CliRunner().invoke(main, [*path, "--help"]).output
    lines = text.partition("\nExamples:\n")[2].splitlines()
    assert len(lines) == 2
    assert all(line.startswith(" ".join(("  ogmkit", *path))) for line in lines)
    assert all(len(line) <= 110 for line in lines)


@of_all
def test_examples_name_commands_and_options_that_there_are(path, command):
    commands = dict(ALL)
    for example in command.examples:
        words = shlex.split(example)[1:]
        called = next(commands[found] for found in commands if found and shlex_path(words, found))
        known = {flag for one in (*main.params, *called.params) for flag in (*one.opts, *one.secondary_opts)}
        assert {word for word in words if word.startswith("-")} <= known


def shlex_path(words, path):
    """Whether a leaf of this path is what the words call, options of `ogmkit` before it or not."""
    plain = words[words.index(path[0]) :] if path[0] in words else []
    return tuple(plain[: len(path)]) == path and not isinstance(dict(ALL)[path], click.Group)


@of_leaves
def test_every_command_is_of_the_shared_class_and_takes_paths_with_a_tilde(path, command):
    assert isinstance(command, Command)
    paths = [one for one in command.params if isinstance(one.type, click.Path)]
    assert paths
    assert all(isinstance(one.type, UserPath) for one in paths)


@of_leaves
def test_one_default_of_workers(path, command):
    for one in command.params:
        if "--workers" in one.opts:
            assert one.default == 1
            assert "Number of worker processes" in one.help
            assert "0 or 1" in one.help


def test_paths_begin_with_a_tilde_where_no_shell_expands_it(monkeypatch, tmp_path, extracted):
    monkeypatch.setenv("HOME", str(extracted.parent))
    assert CliRunner().invoke(main, ["verify", "~/out"]).stdout == f"{extracted}: sound\n"
    monkeypatch.setenv("OGMKIT_VERIFY_LOG_FILE", "~/../verify.log")
    assert CliRunner().invoke(main, ["verify", "~/out"]).exit_code == 0
    assert (extracted.parent.parent / "verify.log").exists()
    assert CliRunner().invoke(main, ["verify", "~nobody-here/out"]).exit_code == 2


def test_an_empty_path_is_a_usage_error(tmp_path):
    result = CliRunner().invoke(main, ["synthesize", ""])
    assert result.exit_code == 2
    assert "the path is empty" in result.stderr


@pytest.mark.parametrize(
    ("variable", "value", "arguments", "expected"),
    [
        ("OGMKIT_TRAIN_LSTM_ED_EPOCHS", "7", [], "epochs: 7"),
        ("OGMKIT_TRAIN_LSTM_ED_EPOCHS", "7", ["--epochs", "8"], "epochs: 8"),
        ("OGMKIT_TRAIN_LSTM_ED_CAMERA", "CAM_BACK, CAM_FRONT", [], "cameras:\n- CAM_BACK\n- CAM_FRONT"),
        ("OGMKIT_TRAIN_MID_TO_END_NO_PAST", "1", [], "no_past: true"),
        ("OGMKIT_TRAIN_FOOTPRINTS_IMAGE_SIZE", "64x96", [], "image_size:\n- 64\n- 96"),
    ],
)
def test_variables_of_the_environment_are_options_of_trainings(
    monkeypatch, tmp_path, variable, value, arguments, expected
):
    pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
    monkeypatch.setenv(variable, value)
    system = next(path[1] for path, _ in LEAVES if path[0] == "train" and _called(path) in variable)
    result = CliRunner().invoke(main, ["train", system, str(tmp_path), "--print-config", *arguments])
    assert result.exit_code == 0, result.output
    assert expected in result.stdout


def _called(path):
    return "_".join(path).upper().replace("-", "_")


def test_a_variable_goes_by_the_options_name_and_is_refused_like_the_option(monkeypatch, extracted):
    monkeypatch.setenv("OGMKIT_HOMOGRAPHY_FIT_WORKERS", "many")
    result = CliRunner().invoke(main, ["homography-fit", str(extracted)])
    assert result.exit_code == 2
    assert "OGMKIT_HOMOGRAPHY_FIT_WORKERS" in result.stderr
    monkeypatch.delenv("OGMKIT_HOMOGRAPHY_FIT_WORKERS")
    monkeypatch.setenv("OGMKIT_PREVIEW_CAMERA", "CAM_SIDE")
    result = CliRunner().invoke(main, ["preview", str(extracted)])
    assert (result.exit_code, "CAM_SIDE" in result.stderr) == (1, True)


def test_only_options_of_commands_come_from_the_environment(monkeypatch):
    monkeypatch.setenv("OGMKIT_VERSION", "3")
    assert CliRunner().invoke(main, ["--version"]).stdout == f"ogmkit {__version__}\n"
    assert CliRunner().invoke(main, []).output.startswith("Usage:")


def test_the_main_help_tells_of_variables_and_no_other():
    assert "OGMKIT_EXTRACT_WORKERS" in CliRunner().invoke(main, ["--help"]).output
    for path, _ in LEAVES:
        shown = CliRunner().invoke(main, [*path, "--help"]).output
        assert "OGMKIT_" not in shown.replace("OGMKIT_CACHE_DIR", "")  # of several commands, so named


@pytest.mark.parametrize("place", ["before", "after"])
def test_a_log_file_gets_all_lines_with_their_time_and_keeps_those_of_earlier_calls(
    tmp_path, extracted, place
):
    log = tmp_path / "a.log"
    given = ["--log-file", str(log)]
    for folder in (extracted, tmp_path):
        words = ["verify", str(folder)]
        CliRunner().invoke(main, [*given, *words] if place == "before" else [*words, *given])
    lines = log.read_text(encoding="utf-8").splitlines()
    assert all(line[:4].isdecimal() and line[10] == "T" for line in lines)
    assert sum(" DEBUG ogmkit: verify took " in line for line in lines) == 2
    assert lines[-1].partition(" ERROR ogmkit: ")[2].startswith(f"error: {tmp_path}: holds no shards")
    assert [type(handler) for handler in LOG.handlers] == [logging.NullHandler]
    assert LOG.level == logging.NOTSET


def test_a_log_file_that_cannot_be_written_is_a_usage_error(tmp_path, extracted):
    result = CliRunner().invoke(main, ["verify", str(extracted), "--log-file", str(tmp_path / "no" / "a")])
    assert result.exit_code == 2
    assert "can't be written" in result.stderr


def test_details_stand_on_stderr_with_their_time_and_results_alone_on_stdout(extracted):
    result = CliRunner().invoke(main, ["verify", "-v", str(extracted)])
    assert result.stdout == f"{extracted}: sound\n"
    assert " ogmkit: verify took " in result.stderr
    assert CliRunner().invoke(main, ["-v", "verify", "-q", str(extracted)]).stderr == ""
    assert CliRunner().invoke(main, ["-q", "verify", "-v", str(extracted)]).stderr != ""


def test_quiet_leaves_errors_and_nothing_else(monkeypatch, tmp_path, extracted):
    now = iter(range(0, 10_000, 100))
    monkeypatch.setattr("time.monotonic", lambda: float(next(now)))
    assert "verify: 2 of 2 shards" in CliRunner().invoke(main, ["verify", str(extracted)]).stderr
    assert CliRunner().invoke(main, ["verify", "-q", str(extracted)]).stderr == ""
    failed = CliRunner().invoke(main, ["-q", "verify", str(tmp_path)])
    assert (failed.exit_code, failed.stderr.count("\n")) == (1, 1)
