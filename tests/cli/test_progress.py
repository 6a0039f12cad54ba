"""Progress: a bar on terminals, gone at the end; lines elsewhere, where work takes long."""

import io

import pytest
from ogmkit_cli.progress import progress


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
