"""Settings that are stated once: a record's field holds default, range, type and help.

Options, keys of YAML files, range errors and the settings' tables come from there.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args, get_origin, get_type_hints

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError

_KEY = "ogmkit"
"""Of a field's metadata."""
_TOO_LARGE = 1 << 63
"""The first whole number that neither arrays nor torch can count to."""


@dataclass(frozen=True)
class Stated:
    """What a field says of its setting, beside name, type and default.

    Attributes:
        help: one sentence.
        group: of options; empty where a record has no groups.
        low: least value; None for no bound. Of a tuple, each entry has it.
        above: a value that is too low, like all below; None for none.
        high: greatest value; None for no bound.
        below: a value that is too high, like all above; None for none.
        form: what the value looks like, for help, such as `HEIGHTxWIDTH`.
        flag: of the option, or several, such as `--camera --cameras`; empty for the field's name.
        unset: what None or an empty tuple means.
        later: the setting is younger than its record; older files lack it.
    """

    help: str
    group: str = ""
    low: float | None = None
    above: float | None = None
    high: float | None = None
    below: float | None = None
    form: str = ""
    flag: str = ""
    unset: str = ""
    later: bool = False

    def flags(self, name: str) -> tuple[str, ...]:
        """The setting's options, such as `--image-size`."""
        return tuple(self.flag.split()) or (f"--{name.replace('_', '-')}",)

    @property
    def range(self) -> str:
        """The numbers that the setting may be, such as `≥ 0, ≤ 1`; empty for no bound."""
        signs = {"≥": self.low, ">": self.above, "≤": self.high, "<": self.below}
        return ", ".join(f"{sign} {bound:g}" for sign, bound in signs.items() if bound is not None)


def setting(
    default: Any,  # noqa: ANN401  # of the field's type
    help: str,
    group: str = "",
    **more: Any,  # noqa: ANN401  # of `Stated`
) -> Any:  # noqa: ANN401
    """A field of a settings record that states all there is to know of it; `more` goes to `Stated`."""
    return field(default=default, metadata={_KEY: Stated(help, group, **more)})


def with_default(
    cls: type[Any],
    name: str,
    default: Any,  # noqa: ANN401  # of the field's type
) -> Any:  # noqa: ANN401
    """The field of a record, with another default."""
    return field(default=default, metadata={_KEY: stated_fields(cls)[name]})


def stated_fields(cls: type[Any]) -> Mapping[str, Stated]:
    """Field → what it says of its setting, in order; fields that state nothing are left out."""
    return {one.name: one.metadata[_KEY] for one in dataclasses.fields(cls) if _KEY in one.metadata}


_hints: Callable[[Any], Mapping[str, Any]] = functools.cache(get_type_hints)


def require_stated(record: Any) -> None:  # noqa: ANN401  # any dataclass instance
    """Check a record's values against what its fields state.

    Raises:
        SettingsError: a number is out of range or not finite, or a value is none of its `Literal`'s.
    """
    hints = _hints(type(record))
    for name, stated in stated_fields(type(record)).items():
        value = getattr(record, name)
        choices = choices_of(hints[name])
        values = value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
        for one in values:
            if choices and one not in choices:
                raise SettingsError(unknown(name, str(one), choices))
            if isinstance(one, int | float):
                _require_range(name, one, stated)


def choices_of(hint: Any) -> tuple[str, ...]:  # noqa: ANN401  # an annotation
    """What a `Literal`, or each of a tuple of them, may be; empty for any other annotation."""
    inner = get_args(hint)[0] if get_origin(hint) is tuple else hint
    return get_args(inner) if get_origin(inner) is Literal else ()


def _require_range(name: str, number: float, stated: Stated) -> None:
    if isinstance(number, int) and abs(number) >= _TOO_LARGE:
        raise SettingsError(f"{name}: a number of {len(str(abs(number)))} digits is too large")
    if stated.low is not None and not number >= stated.low:
        raise SettingsError(f"{name}: {number} is below {stated.low:g}")
    if stated.above is not None and not number > stated.above:
        raise SettingsError(f"{name}: {number} is not above {stated.above:g}")
    if stated.high is not None and not number <= stated.high:
        raise SettingsError(f"{name}: {number} is above {stated.high:g}")
    if stated.below is not None and not number < stated.below:
        raise SettingsError(f"{name}: {number} is not below {stated.below:g}")
    if not math.isfinite(number):
        raise SettingsError(f"{name}: {number} is not finite")
