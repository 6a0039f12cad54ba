"""Terminals that show ASCII only, or less than Unicode."""

import io
import os
import subprocess
import sys

import pytest
from ogmkit_cli.terminal import adapt

ASCII = [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C"}]
HELPS = """
import sys
from ogmkit_cli.main import COMMANDS, main
for name in COMMANDS:
    main([name, "--help"], standalone_mode=False)
main(["train", "holistic", "--help"], standalone_mode=False)
main(["predict", "plan", "--help"], standalone_mode=False)
"""
PROGRESS = """
from ogmkit_cli.main import main
from ogmkit_cli import progress
import sys
try:
    main(["--version"])
except SystemExit:
    pass
progress.LINE_EVERY_S = -1
with progress.progress(None, "scènes", "a → b") as advance:
    advance(1, 2)
"""


def run(variables, *arguments):
    kept = {
        name: value for name, value in os.environ.items() if not name.startswith(("LC_", "LANG", "PYTHON"))
    }
    return subprocess.run(
        [sys.executable, *map(str, arguments)], capture_output=True, env=kept | variables, check=False
    )


@pytest.mark.sampled(1)
@pytest.mark.parametrize("variables", ASCII, ids=str)
def test_help_tables_errors_and_progress_are_ascii(variables, tiny_dataroot, tmp_path):
    odd = tmp_path / "é → b"
    odd.mkdir()
    module = ("-m", "ogmkit_cli")
    for arguments, code in (
        (("-c", HELPS), 0),
        (("-c", PROGRESS), 0),
        ((*module, "inspect", tiny_dataroot), 0),
        ((*module, "verify", odd), 1),
    ):
        result = run(variables, *arguments)
        assert (result.returncode, b"Traceback" in result.stderr) == (code, False), result.stderr
        assert (result.stdout + result.stderr).isascii()


def test_each_character_has_something_that_stands_for_it():
    held = io.BytesIO()
    stream = io.TextIOWrapper(held, encoding="ascii")
    adapt(stream)
    stream.write("a → b … 3 × 2 – é σ 日\udc80")
    stream.flush()
    assert held.getvalue() == rb"a -> b ... 3 x 2 - e sigma \u65e5\udc80"


def test_a_character_set_keeps_what_it_has():
    held = io.BytesIO()
    stream = io.TextIOWrapper(held, encoding="latin-1")
    adapt(stream)
    stream.write("3 × 2 → é")
    stream.flush()
    assert held.getvalue().decode("latin-1") == "3 × 2 -> é"


def test_unicode_is_left_alone():
    result = run({"PYTHONIOENCODING": "utf-8"}, "-m", "ogmkit_cli", "train", "--help")
    assert "image → homography" in result.stdout.decode()
