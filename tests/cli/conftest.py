"""Fixtures that the tests of several commands share."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main

OGMKIT = Path(sys.executable).with_name("ogmkit")
PROGRESS = re.compile(r"(?!ogmkit: )[a-z][\w -]*: ")
"""How a line of progress begins, as `ogmkit_cli.progress` writes it where stderr is not a terminal."""


def without_progress(text):
    return "".join(line for line in text.splitlines(keepends=True) if not PROGRESS.match(line))


class Process:
    """The command in a process group of its own."""

    def __init__(self, *arguments, **options):
        self._popen = subprocess.Popen(
            [OGMKIT, *map(str, arguments)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            **options,
        )

    @property
    def pid(self):
        return self._popen.pid

    def running(self):
        return self._popen.poll() is None

    def send(self, number, *, group=True):
        """Signal the whole group, as a terminal does, or the command alone; False where it has ended."""
        running = self.running()
        if running:
            (os.killpg if group else os.kill)(self._popen.pid, number)
        return running

    def finish(self, timeout_s=60):
        """Its exit code and what it wrote to stderr, but for progress."""
        _, errors = self._popen.communicate(timeout=timeout_s)
        return self._popen.returncode, without_progress(errors.decode())


@pytest.fixture
def complaints():
    """`complaints(text)`: what a command wrote to stderr, but for progress."""
    return without_progress


@pytest.fixture
def start():
    """`start(*arguments, cwd=...)` starts the command and gives its Process; none outlives the test."""
    started = []

    def begin(*arguments, **options):
        started.append(Process(*arguments, **options))
        return started[-1]

    yield begin
    for process in started:
        if process.send(signal.SIGKILL):
            process.finish()


@pytest.fixture(scope="session")
def extracted(shared_folder, tiny_dataroot):
    """Shards of two cameras; tests only read them."""
    grid = ["--cell-size", "0.5", "--rows", "60", "--columns", "40"]
    cameras = ["--camera", "CAM_FRONT", "--camera", "CAM_BACK"]

    def fill(folder):
        paths = [str(tiny_dataroot), str(folder / "out"), "--cache-dir", str(folder / "cache")]
        result = CliRunner().invoke(main, ["extract", *paths, *grid, *cameras])
        assert result.exit_code == 0, result.output

    return shared_folder("extracted", fill) / "out"
