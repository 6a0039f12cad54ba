"""`ogmkit verify`."""

from pathlib import Path

import click

from .command import Command
from .options import json_option
from .paths import ALL_SHARDS
from .progress import progress
from .text import json_text, lines_text


@click.command(
    cls=Command,
    examples=(
        "ogmkit verify shards",
        "ogmkit verify shards --json",
    ),
)
@click.argument("shards", type=ALL_SHARDS)
@json_option
def command(shards: Path, as_json: bool) -> None:
    """Check shards against their schema, checksums and each other.

    Reads all of SHARDS, a folder that `ogmkit extract` finished. Problems are written to stdout, one a line,
    with exit code 1.

    Fields of --json: shards (the folder), sound (true or false), problems (a list: file, message).
    """
    from ogmkit.shards.verify import verify_folder

    with progress(None, "shards", "verify") as advance:
        problems = verify_folder(shards, on_progress=advance)
    if as_json:
        click.echo(json_text({"shards": shards, "sound": not problems, "problems": problems}))
    elif problems:
        click.echo(lines_text(f"{problem.file}: {problem.message}" for problem in problems))
    else:
        click.echo(f"{shards}: sound")
    if problems:
        raise click.exceptions.Exit(1)
