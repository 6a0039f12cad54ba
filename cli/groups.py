"""A group of commands that says which one a mistyped name means."""

from __future__ import annotations

import difflib

import click

from .command import WithExamples


class SuggestingGroup(WithExamples, click.Group):
    """A Click group with examples and suggestions."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order in which they were added."""
        del ctx
        return list(self.commands)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command; for a mistyped one, say which is meant."""
        known = self.list_commands(ctx)
        if args and args[0] not in known and not args[0].startswith("-"):
            close = difflib.get_close_matches(args[0], known, n=2, cutoff=0.5)
            hint = (
                f"Did you mean {' or '.join(map(repr, close))}?"
                if close
                else f"There are: {', '.join(known)}."
            )
            raise click.UsageError(f"No such command {args[0]!r}. {hint}", ctx)
        return super().resolve_command(ctx, args)
