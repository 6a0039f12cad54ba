"""The progress bar: on terminals only, and gone at the end."""

import io

import pytest
from ogmkit_cli.progress import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_nothing_is_written_where_stderr_is_no_terminal(capsys):
    with progress(3, "scenes", "extract") as advance:
        advance(3, 3)

    assert capsys.readouterr() == ("", "")


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
