"""Values of YAML as fields of records."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pytest

from ogmkit.base.values import built, mapping
from ogmkit.errors import SettingsError


@dataclass(frozen=True)
class Thing:
    """One field of each kind."""

    rate: float = 0.5
    count: int = 1
    bound: int | None = 7
    flag: bool = False
    size: tuple[int, int] = (1, 2)
    names: tuple[str, ...] = ()
    kind: Literal["a", "b"] = "a"
    place: Path = Path("x")

    def __post_init__(self):
        if self.count > 9:
            raise SettingsError(f"count: {self.count} is too many")


def test_values_take_the_kind_of_their_field():
    values = {
        "rate": "1e-3",  # what YAML makes of it
        "count": 3,
        "bound": None,
        "flag": True,
        "size": [4, 5],
        "names": ["p", "q"],
        "kind": "b",
        "place": "a/b",
    }
    assert built(Thing, values, "f") == Thing(1e-3, 3, None, True, (4, 5), ("p", "q"), "b", Path("a/b"))
    assert type(built(Thing, {"rate": 2}, "f").rate) is float
    assert built(Thing, {}, "f") == Thing()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rat": 1}, r"f: unknown setting 'rat'; did you mean rate\?"),
        ({"zzzz": 1}, "f: unknown setting 'zzzz'; there are: rate, count, bound"),
        ({"rate": "fast"}, "f: rate: 'fast' is not a number"),
        ({"rate": 10**400}, "f: rate: 10{40}"),
        ({"rate": [[["x" * 9] * 99] * 99] * 99}, r"f: rate: .{,900} is not a number$"),
        ({"kind": 10**400}, r"f: kind: unknown value '10{40}"),
        ({"rate": True}, "f: rate: True is not a number"),
        ({"count": 1.5}, "f: count: 1.5 is not a whole number"),
        ({"count": True}, "f: count: True is not a whole number"),
        ({"count": None}, "f: count: None is not a whole number"),
        ({"bound": "none"}, "f: bound: 'none' is not a whole number"),
        ({"flag": "yes"}, "f: flag: 'yes' is not true or false"),
        ({"size": 3}, "f: size: 3 is not a list"),
        ({"size": [3]}, r"f: size: \[3\] is not a list of 2"),
        ({"size": [3, "x"]}, "f: size: 'x' is not a whole number"),
        ({"names": "p"}, "f: names: 'p' is not a list"),
        ({"names": [3]}, "f: names: 3 is not text"),
        ({"kind": "c"}, "f: kind: unknown value 'c'; there are: a, b"),
        ({"place": 3}, "f: place: 3 is not a path"),
        ({"place": "a\ud800"}, r"f: place: 'a\\ud800' is not a path"),
        ({"place": "a\0b"}, r"f: place: 'a\\x00b' is not a path"),
        ({"count": 10}, "f: count: 10 is too many"),
    ],
)
def test_what_is_wrong_is_named(values, message):
    with pytest.raises(SettingsError, match=f"^{message}"):
        built(Thing, values, "f")


def test_an_empty_section_is_one_without_settings():
    given = {"a": 1}
    copy = mapping(given, "f")
    copy["b"] = 2
    assert (mapping(None, "f"), given) == ({}, {"a": 1})
    for wrong in ([1], "text", {1: 2}):
        with pytest.raises(SettingsError, match="f: not a mapping of setting: value"):
            mapping(wrong, "f")
