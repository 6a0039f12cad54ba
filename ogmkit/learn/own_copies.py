"""Plain values whose pickle depends on what they are alone, not on how they came about."""

import sys
from typing import Any


def own_copies(value: Any) -> Any:  # noqa: ANN401
    """Dictionaries, lists and tuples afresh, all the way down, and equal texts as one; tensors stay.

    Pickle writes an object once and then refers to it: two equal texts take fewer bytes where they are one
    object, as they are in a training that ran through but not in one that read them from a checkpoint.
    """
    if type(value) is str:
        return sys.intern(value)
    if isinstance(value, dict):
        copy = type(value)()
        for key, one in value.items():
            copy[own_copies(key)] = own_copies(one)
        if hasattr(value, "__dict__"):  # a module's state has the versions of its parts beside it
            vars(copy).update(own_copies(vars(value)))
        return copy
    if type(value) in (list, tuple):
        return type(value)(map(own_copies, value))
    return value
