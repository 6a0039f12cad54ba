"""What all commands share: examples in the help, environment variables, options for log lines."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import click
from click.core import ParameterSource

from .logs import LOG, log_options

PREFIX = "OGMKIT"
"""What the names of environment variables begin with."""


class WithExamples(click.Command):
    """A command or group whose help ends in examples.

    Args:
        *arguments: as of Click's class.
        examples: whole command lines.
        **attributes: as of Click's class.
    """

    def __init__(
        self,
        *arguments: Any,  # noqa: ANN401  # of Click's class
        examples: Sequence[str] = (),
        **attributes: Any,  # noqa: ANN401
    ) -> None:
        super().__init__(*arguments, **attributes)
        self.examples = tuple(examples)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """End the help with the examples, a line each."""
        super().format_epilog(ctx, formatter)
        with formatter.section("Examples"):
            for example in self.examples:
                formatter.write(f"{'':>{formatter.current_indent}}{example}\n")


class Command(WithExamples):
    """A command that takes the options for log lines, and all its options from the environment too."""

    def __init__(self, *arguments: Any, **attributes: Any) -> None:  # noqa: ANN401  # as of WithExamples
        super().__init__(*arguments, **attributes)
        self.params += log_options()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read options, also from the environment; a wrong value names the place that it comes from."""
        bind_variables(self, ctx)
        try:
            return super().parse_args(ctx, args)
        except click.BadParameter as error:
            option = error.param
            source = None if option is None else ctx.get_parameter_source(str(option.name))
            if option is not None and source is ParameterSource.ENVIRONMENT:
                error.param_hint = option.envvar
            raise

    def invoke(self, ctx: click.Context) -> object:
        """Run the command, and log how long it took."""
        started = time.monotonic()
        try:
            return super().invoke(ctx)
        finally:
            words = ctx.command_path.partition(" ")[2]
            LOG.debug("%s took %.1f s", words, time.monotonic() - started)


def bind_variables(command: click.Command, context: click.Context) -> None:
    """Name each option's environment variable as the user knows the option: OGMKIT_EXTRACT_MAX_GAP."""
    prefix = context.auto_envvar_prefix
    for option in command.params:
        if isinstance(option, click.Option) and option.allow_from_autoenv and prefix is not None:
            option.envvar = variable(prefix, option)
            option.allow_from_autoenv = False  # Click's own goes by the name of the function's parameter


def variable(prefix: str, option: click.Option) -> str:
    """The environment variable of an option."""
    name = next(flag for flag in option.opts if flag.startswith("--"))
    return f"{prefix}{name.removeprefix('-').replace('-', '_').upper()}"
