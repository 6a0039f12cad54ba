"""Calls in processes of their own: what comes home, and how they end."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from ogmkit.base.news import Found, Stopping, listening, tell
from ogmkit.base.side_by_side import SideBySide
from ogmkit.errors import OgmkitError, TrainingError

PATIENCE_S = 60


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    """Functions of this file can be imported by processes that are started."""
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2])


def ignore(done, total):
    del done, total


def wait_until(holds):
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


@dataclass(frozen=True)
class Meet:
    """Ends only if the other one has begun: both wait for each other's file."""

    own: Path
    other: Path

    def __call__(self, on_progress):
        self.own.touch()
        wait_until(self.other.exists)
        on_progress(3, 4)
        tell(Found("met"))
        return os.getpid(), os.environ["PLACE"]


@dataclass(frozen=True)
class Fail:
    """Ends with an error, or as a process that is killed."""

    error: Exception | None

    def __call__(self, on_progress):
        if self.error is None:
            os.kill(os.getpid(), signal.SIGKILL)
        raise self.error


@dataclass(frozen=True)
class Last:
    """Works until it is asked to end, which it takes down."""

    begun: Path
    kept: Path

    def __call__(self, on_progress):
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        self.begun.touch()
        try:
            time.sleep(PATIENCE_S)
        except KeyboardInterrupt:
            self.kept.touch()
            raise


def test_two_work_at_once_and_tell(tmp_path):
    a, b = tmp_path / "a", tmp_path / "b"
    told, counts, results = [], [], {}
    with listening(told.append), SideBySide() as calls:
        calls.begin("one", Meet(a, b), {"PLACE": "first"}, lambda *count: counts.append(("one", *count)))
        calls.begin("two", Meet(b, a), {"PLACE": "second"}, lambda *count: counts.append(("two", *count)))
        assert calls.names == ("one", "two")
        while calls.names:
            results |= calls.ended()
    assert {place for _, place in results.values()} == {"first", "second"}
    assert len({os.getpid(), *(pid for pid, _ in results.values())}) == 3
    assert sorted(counts) == [("one", 3, 4), ("two", 3, 4)]
    first, second = (one.text for one in told)
    assert first in ("one: met", "two: met")
    assert second in ("one: met", "two: met", "met")  # alone by then, perhaps
    assert "PLACE" not in os.environ


@pytest.mark.parametrize(
    ("error", "kind", "message"),
    [
        (TrainingError("the loss is not finite"), TrainingError, "^bad: the loss is not finite$"),
        (None, OgmkitError, "^bad: its process ended with code -9"),
    ],
)
def test_when_one_fails_the_others_keep_what_they_have(tmp_path, error, kind, message):
    begun, kept = tmp_path / "begun", tmp_path / "kept"

    def fail():
        with SideBySide() as calls:
            calls.begin("good", Last(begun, kept), {}, ignore)
            wait_until(begun.exists)
            calls.begin("bad", Fail(error), {}, ignore)
            while calls.names:
                calls.ended()

    with pytest.raises(kind, match=message):
        fail()
    assert kept.exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_lets_all_keep_what_they_have(tmp_path, number):
    told, begun, kept = [], tmp_path / "begun", tmp_path / "kept"
    before = signal.getsignal(signal.SIGTERM)

    def interrupted():
        with listening(told.append), SideBySide() as calls:
            calls.begin("one", Last(begun, kept), {}, ignore)
            wait_until(begun.exists)
            os.kill(os.getpid(), number)
            calls.ended()

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert kept.exists()
    assert told == [Stopping("step")]
    assert signal.getsignal(signal.SIGTERM) == before


def test_they_end_with_the_process_that_began_them(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(
        textwrap.dedent(f"""
        import sys
        from pathlib import Path
        sys.path.insert(0, {str(Path(__file__).parent)!r})
        from test_side_by_side import Pid, ignore
        from ogmkit.base.side_by_side import SideBySide
        if __name__ == "__main__":
            with SideBySide() as calls:
                calls.begin("one", Pid(Path({str(tmp_path / "pid")!r})), {{}}, ignore)
                calls.ended()
        """)
    )
    parent = subprocess.Popen([sys.executable, str(script)])
    wait_until((tmp_path / "pid").exists)
    parent.kill()
    parent.wait()
    pid = int((tmp_path / "pid").read_text())
    wait_until(lambda: not Path(f"/proc/{pid}/cmdline").exists() or _is_zombie(pid))


def _is_zombie(pid):
    return "State:\tZ" in Path(f"/proc/{pid}/status").read_text()


@dataclass(frozen=True)
class Pid:
    """Tells its process, and never ends."""

    path: Path

    def __call__(self, on_progress):
        part = self.path.with_suffix(".part")
        part.write_text(str(os.getpid()))
        part.rename(self.path)
        time.sleep(PATIENCE_S)
