"""Names in messages: several, and one that isn't there."""

import difflib
from collections.abc import Sequence

_LISTED = 8


def unknown(kind: str, name: str, known: Sequence[str]) -> str:
    """A message such as `unknown scene 'scene-13': did you mean scene-0013?`.

    Args:
        kind: what the name stands for, such as `scene`.
        name: the unknown one.
        known: those there are.
    """
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.6)
    if close:
        return f"unknown {kind} {name!r}; did you mean {' or '.join(close)}?"
    return f"unknown {kind} {name!r}; there are: {listed(known, _LISTED) or 'none'}"


def listed(names: Sequence[str], most: int) -> str:
    """The first names, at most so many, and how many more there are: `a, b and 3 more`."""
    others = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + others
