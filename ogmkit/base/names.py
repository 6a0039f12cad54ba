"""Names: those that a pattern means, and in messages several, or one that isn't there; numbers, durations."""

import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from ogmkit.errors import SettingsError

_LISTED = 8


def unknown(kind: str, name: str, known: Sequence[str]) -> str:
    """A message such as `unknown scene 'scene-13': did you mean scene-0013?`.

    Args:
        kind: what the name stands for, such as `scene`.
        name: the unknown one.
        known: those there are.
    """
    return f"unknown {kind} {name!r}; {_hint(name, known)}"


def matching(kind: str, wanted: Sequence[str], known: Sequence[str], where: Path) -> tuple[str, ...]:
    """The names that are wanted, each given by itself or by a pattern such as `scene-00*`.

    Args:
        kind: what the names stand for, such as `scene`.
        wanted: names and patterns, in which `*`, `?` and `[…]` mean what they mean to a shell; none means
            all.
        known: the names there are.
        where: the folder that has them, for messages.

    Returns:
        Names in the order of `known`, each once.

    Raises:
        SettingsError: a name is unknown, or a pattern matches none.
    """
    found = set() if wanted else set(known)
    for one in wanted:
        matches = [one] if one in known else [name for name in known if fnmatchcase(name, one)]
        if not matches and any(mark in one for mark in "*?["):
            raise SettingsError(f"{where}: no {kind} matches {one!r}; {_hint(one, known)}")
        if not matches:
            raise SettingsError(f"{where}: {unknown(kind, one, known)}")
        found.update(matches)
    return tuple(dict.fromkeys(name for name in known if name in found))


def listed(names: Sequence[str], most: int) -> str:
    """The first names, at most so many, and how many more there are: `a, b and 3 more`."""
    others = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + others


def _hint(name: str, known: Sequence[str]) -> str:
    """What may be meant by a name, or else what there is."""
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.6)
    close = close or [one for one in known if name and one.startswith(name)][:3]
    if close:
        return f"did you mean {' or '.join(close)}?"
    return f"there are: {listed(known, _LISTED) or 'none'}"


def with_number(count: int, noun: str) -> str:
    """`1 box`, `2 boxes`."""
    ending = "" if count == 1 else "es" if noun.endswith(("s", "x")) else "s"
    return f"{count:,} {noun}{ending}"


def in_words(seconds: float) -> str:
    """A duration to two digits: `40 s`, `12 min`, `3.5 h`, `2.1 days`."""
    units = {"days": 86400, "h": 3600, "min": 60, "s": 1}
    unit = next((unit for unit, size in units.items() if seconds >= 1.5 * size), "s")
    return f"{float(f'{seconds / units[unit]:.2g}'):g} {unit}"
