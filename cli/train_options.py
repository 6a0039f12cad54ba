"""The settings of a training as options, made from what the settings' fields state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import NoneType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import click

from ogmkit.learn.catalogue import SystemEntry, all_settings, readers
from ogmkit.learn.settings import Stated, stated_fields

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


def flag_of(name: str, stated: Stated) -> str:
    """The option of a setting, such as `--image-size`."""
    return stated.flag or f"--{name.replace('_', '-')}"


def setting_options(entry: SystemEntry) -> Callable[[Function], Function]:
    """An option for each setting that a system reads, handed to the command by the settings' names."""
    cls = entry.settings
    hints, defaults = get_type_hints(cls), cls().to_dict()
    options = [
        _option(name, stated, hints[name], defaults[name]) for name, stated in stated_fields(cls).items()
    ]

    def decorate(function: Function) -> Function:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


def _option(
    name: str,
    stated: Stated,
    hint: Any,  # noqa: ANN401  # an annotation
    default: Any,  # noqa: ANN401  # of that type, as JSON has it
) -> Callable[[Function], Function]:
    flag = flag_of(name, stated)
    shown: dict[str, Any] = {"help": stated.help, "show_default": True if default else stated.unset or True}
    kind = next((one for one in get_args(hint) if one is not NoneType), hint) if _optional(hint) else hint
    if kind is bool:
        return click.option(flag, name, is_flag=True, default=default, help=stated.help)
    if kind == tuple[str, ...]:
        return list_option(flag, name, default=default, metavar=stated.form, **shown)
    if get_origin(kind) is Literal:
        return click.option(flag, name, type=click.Choice(get_args(kind)), default=default, **shown)
    if get_origin(kind) is tuple:
        read = ratio if stated.form == "A/B" else size
        default = default if default is None else "x".join(map(str, default))
        return click.option(flag, name, type=read, default=default, metavar=stated.form, **shown)
    return click.option(flag, name, type=kind, default=default, metavar=stated.form or None, **shown)


def _optional(hint: Any) -> bool:  # noqa: ANN401  # an annotation
    return NoneType in get_args(hint)


class TrainCommand(click.Command):
    """The command that trains one system; its help has the settings in groups.

    Attributes:
        entry: the system.
    """

    entry: SystemEntry

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse a setting of other systems by naming them."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            known = {flag_of(name, stated): name for name, stated in all_settings().items()}
            if error.option_name not in known:
                raise
            found = ", ".join(readers(known[error.option_name]))
            raise click.UsageError(
                f"{error.option_name} is a setting of {found}; {self.entry.name} does not read it.", ctx
            ) from error

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the settings by group, and what isn't a setting last."""
        stated = stated_fields(self.entry.settings)
        groups: dict[str, list[tuple[str, str]]] = {
            "Data": [],
            "Model": [],
            "Optimisation": [],
            "Run": [],
            "Other": [],
        }
        for parameter in self.get_params(ctx):
            if not isinstance(parameter, click.Option):
                continue  # the usage line has them
            record = parameter.get_help_record(ctx)
            if record is not None:
                name = str(parameter.name)
                groups[stated[name].group if name in stated else "Other"].append(record)
        for group, records in groups.items():
            with formatter.section(f"{group} options"):
                formatter.write_dl(records)
