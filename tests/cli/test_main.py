"""The shell round the commands: exit codes, one-line errors, and how little it imports."""

import errno
import os
import subprocess
import sys
import tempfile

import click
import h5py
import pytest
from click.testing import CliRunner
from ogmkit_cli import main as shell

from ogmkit import __version__
from ogmkit.errors import SettingsError, TableError

HEAVY = {"numpy", "cv2", "duckdb", "h5py", "shapely", "pyquaternion", "PIL", "tqdm", "torch"}


@pytest.fixture
def run_raising(monkeypatch):
    """Run `ogmkit fail` with a command that raises what it is given."""

    def run(error):
        @click.command()
        def command():
            """Fail."""
            raise error

        monkeypatch.setitem(shell.COMMANDS, "fail", "Fail.")
        monkeypatch.setattr(shell.main, "get_command", lambda context, name: command)
        return CliRunner().invoke(shell.main, ["fail"])

    return run


@pytest.mark.parametrize(
    ("error", "line", "code"),
    [
        (TableError("scene.json: record 7: broken"), "ogmkit: error: scene.json: record 7: broken", 1),
        (SettingsError("grid: no"), "ogmkit: error: grid: no", 1),
        (KeyboardInterrupt(), "ogmkit: interrupted", 130),
        (
            MemoryError(),
            "ogmkit: error: out of memory; try fewer --workers or a smaller grid",
            1,
        ),
        (
            OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "x.h5"),
            "ogmkit: error: x.h5: No space left on device; check the disk and permissions, then run again",
            1,
        ),
    ],
)
def test_expected_failures_are_one_line_on_stderr(run_raising, error, line, code):
    result = run_raising(error)

    assert (result.exit_code, result.stderr.strip(), result.stdout) == (code, line, "")


def test_an_interrupted_command_says_whether_it_resumes(run_raising, monkeypatch):
    monkeypatch.setattr(shell, "RESUMABLE", {"fail"})

    assert run_raising(KeyboardInterrupt()).stderr == "ogmkit: interrupted; run the same command to resume\n"


def test_commands_that_resume_are_commands():
    assert set(shell.COMMANDS) >= shell.RESUMABLE


def test_a_message_with_line_breaks_and_control_characters_stays_one_harmless_line(run_raising):
    result = run_raising(TableError("scene\nname \x1b[31m é\udc80"))

    assert result.stderr == "ogmkit: error: scene name \\x1b[31m é\\udc80\n"


def test_an_error_nobody_foresaw_is_one_line_and_its_traceback_is_kept(run_raising, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    result = run_raising(ZeroDivisionError("a bug \x1b[31m"))

    (kept,) = tmp_path.iterdir()
    assert (result.exit_code, result.stdout) == (70, "")
    assert result.stderr == (
        "ogmkit: internal error: ZeroDivisionError: a bug \\x1b[31m; please report it with its traceback, "
        f"kept in {kept}\n"
    )
    assert "in command" in kept.read_text()


def test_an_interrupt_that_a_callback_of_hdf5_turned_into_another_error_is_one(run_raising, tmp_path):
    def interrupt(name, link):
        raise KeyboardInterrupt

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = 1
        with pytest.raises(SystemError) as raised:
            file.id.links.visit(interrupt, info=True)
    result = run_raising(raised.value)

    assert (result.exit_code, result.stdout) == (130, "")
    assert result.stderr == "ogmkit: interrupted\n"


def test_a_traceback_that_can_t_be_kept_is_said(run_raising, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "absent"))
    result = run_raising(ZeroDivisionError("bug"))

    assert result.exit_code == 70
    assert result.stderr.endswith("bug; its traceback can't be kept (No such file or directory)\n")


def test_a_closed_pipe_ends_quietly(run_raising):
    result = run_raising(BrokenPipeError(errno.EPIPE, "Broken pipe"))

    assert (result.exit_code, result.output) == (1, "")


def test_usage_errors_exit_with_2():
    assert CliRunner().invoke(shell.main, ["no-such-command"]).exit_code == 2
    assert CliRunner().invoke(shell.main, ["--no-such-option"]).exit_code == 2


@pytest.mark.parametrize(("typed", "meant"), [("extrct", "extract"), ("homography_fit", "homography-fit")])
def test_a_mistyped_command_gets_a_suggestion(typed, meant):
    result = CliRunner().invoke(shell.main, [typed])

    assert result.exit_code == 2
    assert f"No such command {typed!r}. Did you mean {meant!r}" in result.stderr


def test_a_command_like_no_other_gets_no_suggestion():
    assert "Did you mean" not in CliRunner().invoke(shell.main, ["zzzz"]).stderr


@pytest.mark.parametrize("module", ["ogmkit", "ogmkit_cli"])
def test_runs_as_a_module(module):
    arguments = [sys.executable, "-m", module, "--version"]
    result = subprocess.run(arguments, capture_output=True, text=True, check=True)

    assert result.stdout == f"ogmkit {__version__}\n"


def test_version():
    assert CliRunner().invoke(shell.main, ["--version"]).stdout == f"ogmkit {__version__}\n"


@pytest.mark.parametrize("arguments", [[], ["--help"]])
def test_help_lists_every_command_in_order(arguments):
    text = CliRunner().invoke(shell.main, arguments, terminal_width=100).output
    listed = text.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()

    assert [line.split(maxsplit=1) for line in listed] == [[*item] for item in shell.COMMANDS.items()]


@pytest.mark.parametrize("name", shell.COMMANDS)
def test_each_command_loads_and_says_what_the_table_says(name):
    command = shell.main.get_command(click.Context(shell.main), name)

    assert command.get_short_help_str(limit=200) == shell.COMMANDS[name]


def test_help_of_the_group_and_of_each_command_imports_nothing_heavy():
    """But numpy, for settings that hold a grid or the rig's cameras: these commands come last."""
    with_numpy = ("check", "extract", "synthesize")
    names = sorted(shell.COMMANDS, key=lambda name: name in with_numpy)
    code = f"""
import sys
from ogmkit_cli.main import main
for arguments in (["--help"], *([name, "--help"] for name in {names!r})):
    before = set(sys.modules)
    main(arguments, standalone_mode=False)
    allowed = {{"numpy"}} if arguments[0] in {with_numpy!r} else set()
    heavy = {HEAVY} & sys.modules.keys() - before - allowed
    print(*heavy and (arguments[0], *heavy), file=sys.stderr, end="")
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert result.stderr == ""


def test_the_console_script_reports_a_failure_without_traceback(tmp_path):
    code = "import sys; from ogmkit_cli.main import main; sys.argv[0] = 'ogmkit'; main()"
    arguments = [sys.executable, "-c", code, "preview", str(tmp_path)]
    result = subprocess.run(arguments, capture_output=True, text=True, check=False)

    assert result.returncode == 1
    assert result.stderr.startswith(f"ogmkit: error: {tmp_path}")
    assert result.stderr.count("\n") == 1
