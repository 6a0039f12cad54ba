"""`ogmkit verify`."""

from pathlib import Path

import click

from .command import Command
from .options import json_option, scheduler_option, workers_option
from .paths import ALL_SHARDS
from .progress import progress
from .text import json_text, lines_text


@click.command(
    cls=Command,
    examples=(
        "ogmkit verify shards",
        "ogmkit verify shards --json --workers 8",
    ),
)
@click.argument("shards", type=ALL_SHARDS)
@workers_option
@scheduler_option
@json_option
def command(shards: Path, workers: int, scheduler: str, as_json: bool) -> None:
    """Check shards against their schema, checksums and each other.

    Reads all of SHARDS, a folder that `ogmkit extract` finished. Problems are written to stdout, one a line,
    with exit code 1.

    Fields of --json: shards (the folder), sound (true or false), problems (a list: file, message).
    """
    from ogmkit.base.execution import Execution
    from ogmkit.shards.verify import verify_folder

    with progress(None, "shards", "verify") as advance:
        problems = verify_folder(shards, execution=Execution(workers, scheduler, on_progress=advance))
    if as_json:
        click.echo(json_text({"shards": shards, "sound": not problems, "problems": problems}))
    elif problems:
        click.echo(lines_text(f"{problem.file}: {problem.message}" for problem in problems))
    else:
        click.echo(f"{shards}: sound")
    if problems:
        raise click.exceptions.Exit(1)
