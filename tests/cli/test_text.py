"""Data on a terminal: what it holds can't move the cursor, break a line or colour anything."""

from ogmkit_cli.evaluate_text import report_text
from ogmkit_cli.text import lines_text, text_table

from ogmkit.evaluation.tables import Report, Table


def test_cells_of_a_table_hold_no_control_characters():
    table = text_table(("name", "count"), [("a\x1b[31m", 7), ("b\nc", 1234), ("é\udc80", 1)])

    assert table.splitlines() == [
        "name       count",
        "a\\x1b[31m      7",
        "b c        1,234",
        "é\\udc80        1",
    ]


def test_lines_stay_lines():
    assert lines_text(["a\nb", "\x9b2J"]) == "a b\n\\x9b2J"


def test_an_evaluation_holds_no_control_characters():
    row = ("run\x1b]0;x\x07", "1.0")
    report = Report("head\x1b[2J", (Table("title", (), ("system", "IoU"), (row,), ()),), (), "")

    assert not {"\x1b", "\x07"} & set(report_text(report))
