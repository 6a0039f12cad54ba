"""The settings of a training as options, made from what the settings' fields state."""

from __future__ import annotations

import click

from ogmkit.base.stated import stated_fields
from ogmkit.learn.catalogue import SystemEntry, all_settings, readers

from .command import Command


class TrainCommand(Command):
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
            known = {flag: name for name, stated in all_settings().items() for flag in stated.flags(name)}
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
