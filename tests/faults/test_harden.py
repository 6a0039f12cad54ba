"""A sample of what `make harden` does at length, and that the harness tells good ends from bad ones."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

HARDEN = Path(__file__).with_name("harden.py")


def test_a_sample_of_faults_kills_and_broken_inputs_comes_out_well():
    pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
    command = [sys.executable, HARDEN, "--sample", "16"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.stdout, result.stderr
    counts = json.loads(result.stdout)
    assert counts["bad"] == []
    assert sum(counts["outcomes"].values()) >= 12
    assert result.returncode == 0


@pytest.fixture
def harness(monkeypatch, tmp_path):
    """The package beside this file, and a folder in which its forked processes run."""
    monkeypatch.syspath_prepend(HARDEN.parent)
    (tmp_path / "case").mkdir()
    import harness

    return harness


@pytest.fixture
def ended(harness, tmp_path):
    """How a function ends in a forked process with patched functions of Python: `ended(function, fault)`."""
    from harness.forked import Forker
    from harness.patched import PatchedInjector
    from harness.shim import COUNT

    forker = Forker(tmp_path, PatchedInjector())
    return lambda function, fault=COUNT: forker.call(function, fault)


def say_and_exit(text, code):
    def run():
        print(text, file=sys.stderr)
        sys.exit(code)

    return run


def raise_bare():
    raise ValueError("unforeseen")


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (lambda: None, "ok"),
        (say_and_exit("extract: 3 of 4\nogmkit: error: world/a.json: absent; restore it", 1), "named error"),
        (say_and_exit("ogmkit: error: [Errno 5] Input/output error", 1), "unnamed error"),
        (say_and_exit("ogmkit: error: world/a.json: absent\nand more", 1), "unnamed error"),
        (say_and_exit("ogmkit: internal error: KeyError: 'world'", 70), "traceback"),
        (raise_bare, "traceback"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "crash"),
    ],
)
def test_ends_are_told_apart(ended, function, expected):
    from harness.outcome import of_end

    assert of_end(ended(function), {"world"}) == expected


def test_a_hang_ends_by_force(ended, monkeypatch):
    import time

    from harness import forked
    from harness.outcome import of_end

    monkeypatch.setattr(forked, "LIMIT_S", 0.2)
    assert of_end(ended(lambda: time.sleep(60)), ()) == "hang"


def test_memory_over_the_limit_is_told(ended, monkeypatch):
    from harness import outcome

    monkeypatch.setattr(outcome, "_MOST_BYTES", 1 << 20)
    assert outcome.of_end(ended(lambda: None), ()) == "over 2 GB"


def test_files_that_are_lost_or_wrong_are_told(ended):
    from harness.outcome import differing, of_files, of_result

    before, sound = {"a": "1", "b": "2"}, {"a": "1", "b": "3", "c": "4"}
    assert of_files(before, before, sound) == of_files(before, sound, sound) == "ok"
    assert of_files(before, {"a": "1"}, sound) == of_files(before, {"a": "1", "b": "x"}, sound) == "lost"
    whole = ended(lambda: None)
    assert of_result(whole, sound, whole, sound, speaks=False) == "ok"
    assert of_result(whole, before, whole, sound, speaks=False) == "silently wrong"
    assert of_result(ended(lambda: print("else")), sound, whole, sound, speaks=True) == "silently wrong"
    assert differing(before, sound) == ["b", "c"]


def write_three():
    for name in "abc":
        Path(name).write_text(name)


def test_the_kth_operation_is_refused_and_no_other(ended, tmp_path):
    from harness.shim import Fault

    refused = ended(write_three, Fault("open", 2, "fail", errno.ENOSPC))
    assert refused.hit
    assert "No space left on device" in refused.stderr
    assert [path.name for path in (tmp_path / "case").iterdir()] == ["a"]
    assert ended(write_three).counts["open"] == 3


def test_a_kill_at_an_operation(ended):
    from harness.shim import Fault

    assert ended(write_three, Fault("open", 2, "kill")).signal == 9
    assert not ended(write_three, Fault("open", 4, "kill")).hit


def test_the_page_has_the_counts_that_were_measured(harness):
    from harness.table import sums

    page = (HARDEN.parents[2] / "docs" / "reliability.md").read_text(encoding="utf-8")
    stated = re.search(r"<!-- counts: begin -->\n(.*?)\n<!-- counts: end -->", page, re.DOTALL)
    assert stated[1] == sums(HARDEN.parents[2] / "benchmarks" / "results" / "harden")
