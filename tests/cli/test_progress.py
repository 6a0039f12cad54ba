"""Progress: a bar on terminals, gone at the end; lines elsewhere, where work takes long."""

import io
import subprocess
import sys
import threading

import pytest
from ogmkit_cli.progress import progress

from ogmkit.base.news import Found, Passed, Quitting, State, Stopping, Waiting, tell


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Moments that pass when `clock[0]` is set."""
    now = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    return now


def test_quick_work_writes_nothing_where_stderr_is_no_terminal(capsys):
    with progress(3, "scenes", "extract") as advance:
        advance(3, 3)

    assert capsys.readouterr() == ("", "")


def test_long_work_writes_a_line_every_ten_seconds_where_stderr_is_no_terminal(clock, capsys):
    with progress(None, "scenes", "extract") as advance:
        for done in range(1, 26):
            clock[0] = done * 1.0
            advance(done, 4000)

    assert capsys.readouterr().err.splitlines() == [
        "extract: 10 of 4,000 scenes, 1 scenes/s, 1:06:30 left",
        "extract: 20 of 4,000 scenes, 1 scenes/s, 1:06:20 left",
    ]


def test_what_a_resumed_run_found_done_does_not_count_as_speed(clock, capsys):
    with progress(None, "steps", "train") as advance:
        advance(101, 161)
        clock[0] = 20.0
        advance(110, 161)

    assert capsys.readouterr().err == "train: 110 of 161 steps, 0.5 steps/s, 1:42 left\n"


def test_no_time_left_is_told_before_anything_is_done(clock, capsys):
    with progress(None, "scenes", "extract") as advance:
        advance(0, 5)
        clock[0] = 15.0
        advance(0, 5)

    assert capsys.readouterr().err == "extract: 0 of 5 scenes, 0 scenes/s\n"


@pytest.mark.parametrize("error", [None, KeyboardInterrupt()])
def test_a_terminal_sees_a_bar_that_leaves_a_clean_line(monkeypatch, error):
    stderr = Terminal()
    monkeypatch.setattr("sys.stderr", stderr)

    def work():
        with progress(None, "scenes", "extract") as advance:
            advance(0, 4)
            advance(3, 4)
            if error is not None:
                raise error

    if error is None:
        work()
    else:
        with pytest.raises(KeyboardInterrupt):
            work()

    drawn, cleared = stderr.getvalue(), stderr.getvalue().rsplit("\r", 2)[1:]
    assert "extract" in drawn
    assert "scenes" in drawn
    assert [part.strip() for part in cleared] == ["", ""]


def test_news_are_lines_where_stderr_is_no_terminal(clock, capsys):
    with progress(None, "steps", "train") as advance:
        clock[0] = 30.0
        tell(Found("7 frames; cpu"))
        tell(Waiting("loading torch"))
        tell(State("epoch 1/2, loss 0.5"))
        advance(1, 20)
        clock[0] = 40.0
        advance(11, 20)
        tell(Passed("epoch 1/2: loss 0.4"))

    assert capsys.readouterr().err.splitlines() == [
        "train: 7 frames; cpu",
        "train: loading torch",
        "train: 11 of 20 steps, 1.1 steps/s, 0:08 left, epoch 1/2, loss 0.5",
        "train: epoch 1/2: loss 0.4",
    ]


def test_on_a_terminal_what_was_found_stands_above_the_bar_and_the_rest_behind_it(monkeypatch):
    stderr = Terminal()
    monkeypatch.setattr("sys.stderr", stderr)
    with progress(None, "scenes", "extract") as advance:
        tell(Found("7 scenes"))
        tell(Waiting("decoding map a.png"))
        advance(1, 7)
        tell(State("epoch 1/2"))
        tell(Passed("epoch 1/2: loss 0.4"))
        advance(7, 7)

    text = stderr.getvalue()
    assert "extract: 7 scenes\n" in text
    assert text.count("\n") == 1
    assert "decoding map a.png]" in text
    assert "loss 0.4" not in text
    assert text.rsplit("\r", 2)[1].strip() == ""


def test_ctrl_c_is_answered_in_the_same_words_everywhere(monkeypatch, capsys):
    with progress(None, "steps", "train"):
        tell(Stopping("validation"))
    line = "ogmkit: stopping after this validation; press Ctrl-C again to quit now\n"
    assert capsys.readouterr().err == line
    stderr = Terminal()
    monkeypatch.setattr("sys.stderr", stderr)
    with progress(None, "steps", "train"):
        tell(Stopping("validation"))
    assert line in stderr.getvalue()


STUCK = """
import hashlib
from ogmkit.base.news import Quitting, tell
from ogmkit_cli.progress import progress

with progress(None, "steps", "train"):
    tell(Quitting())
    tell(Quitting())
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2**31 - 1)
"""


def test_a_second_ctrl_c_ends_a_process_that_is_stuck_in_a_long_call():
    done = subprocess.run(
        [sys.executable, "-c", STUCK], capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (130, "ogmkit: interrupted; run the same command to resume\n")


def test_a_second_ctrl_c_leaves_a_process_that_ends_by_itself(capsys):
    with progress(None, "steps", "train"):
        tell(Quitting())

    timers = [thread for thread in threading.enumerate() if isinstance(thread, threading.Timer)]
    assert all(timer.finished.is_set() for timer in timers)  # cancelled: it would have ended this process
    assert capsys.readouterr().err == ""
