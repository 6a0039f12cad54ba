from pathlib import Path

from ogmkit.base.places import place


def test_a_place_is_relative_to_the_folder_unless_it_says_otherwise(monkeypatch):
    monkeypatch.setenv("HOME", "/home/me")
    assert place("a/../b", Path("folder")) == Path("folder/b")
    assert place("/b", Path("folder")) == Path("/b")
    assert place("~/b", Path("folder")) == Path("/home/me/b")
    assert place(Path("b/~")) == Path("b/~")
