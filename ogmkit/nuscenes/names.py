"""What to say about a name that isn't there."""

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
    listed = ", ".join(known[:_LISTED]) + (
        f" and {len(known) - _LISTED} more" if len(known) > _LISTED else ""
    )
    return f"unknown {kind} {name!r}; there are: {listed or 'none'}"
