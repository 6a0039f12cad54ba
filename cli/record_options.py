"""Options made from what the fields of a settings record state."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import click

from ogmkit.base.stated import Stated, choices_of, stated_fields

from .options import list_option, size

Function = TypeVar("Function", bound=Callable[..., Any])


def ratio(value: str | Sequence[int]) -> tuple[int, int]:
    """An option's type: A/B, such as 77/9."""
    if not isinstance(value, str):
        first, second = value
        return first, second
    left, _, right = value.partition("/")
    if not (left.isdecimal() and right.isdecimal() and int(left) and int(right)):
        raise click.BadParameter(f"{value!r} is not A/B, such as 77/9")
    return int(left), int(right)


def setting_options(cls: type[Any], *names: str) -> Callable[[Function], Function]:
    """An option for each field of a record that states its setting, handed on by the fields' names.

    Args:
        cls: the record's type.
        names: the fields; none means all.
    """
    hints, record = get_type_hints(cls), cls()
    options = [
        _option(name, stated, hints[name], getattr(record, name))
        for name, stated in stated_fields(cls).items()
        if not names or name in names
    ]

    def decorate(function: Function) -> Function:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


def record_options(cls: type[Any], name: str) -> Callable[[Function], Function]:
    """Such options, handed to the command as one record of that name."""
    names = tuple(stated_fields(cls))

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def with_record(*args: object, **kwargs: Any) -> object:  # noqa: ANN401  # of several options
            record = cls(**{one: kwargs.pop(one) for one in names})
            return function(*args, **kwargs, **{name: record})

        return setting_options(cls)(with_record)  # type: ignore[return-value]  # but for `name`

    return decorate


def _option(
    name: str,
    stated: Stated,
    hint: Any,  # noqa: ANN401  # an annotation
    default: Any,  # noqa: ANN401  # of that type
) -> Callable[[Function], Function]:
    kind = next(one for one in get_args(hint) if one is not NoneType) if NoneType in get_args(hint) else hint
    flags = (*stated.flags(name), name)
    if kind is bool:
        return click.option(*flags, is_flag=True, default=default, show_default=default, help=stated.help)
    shown = {
        "help": stated.help,
        "metavar": stated.form or None,
        "show_default": stated.unset or True,
        "default": default,
    }
    if get_args(kind)[1:] == (...,):
        shown["help"] = f"{stated.help.removesuffix('.')}; repeat the option or separate values by commas."
        return list_option(*flags, choices=choices_of(kind), **shown)
    if get_origin(kind) is tuple:
        read = ratio if stated.form == "A/B" else size
        shown["default"] = default if default is None else "x".join(map(str, default))
        return click.option(*flags, type=read, **shown)
    return click.option(*flags, type=_scalar_type(kind, stated), **shown)


def _scalar_type(kind: Any, stated: Stated) -> Any:  # noqa: ANN401  # an annotation; what Click takes
    if choices_of(kind):
        return click.Choice(choices_of(kind))
    if kind is int and (stated.low, stated.high) != (None, None):
        return click.IntRange(_whole(stated.low), _whole(stated.high))
    if kind is float:
        low, high = _bound(stated.low, stated.above), _bound(stated.high, stated.below)
        if (low, high) != (None, None):
            return click.FloatRange(
                low, high, min_open=stated.above is not None, max_open=stated.below is not None
            )
    if kind is str:
        return os.path.expanduser  # names of systems and splits begin with no `~`
    return kind


def _whole(bound: float | None) -> int | None:
    return None if bound is None else int(bound)


def _bound(closed: float | None, opened: float | None) -> float | None:
    return closed if opened is None else opened
