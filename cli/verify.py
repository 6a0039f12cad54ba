"""`ogmkit verify`."""

from pathlib import Path

import click

from .options import shards_argument
from .progress import progress


@click.command()
@shards_argument
def command(shards: Path) -> None:
    """Check shards against their schema, checksums and each other.

    Reads all of SHARDS, a folder that `ogmkit extract` finished. Problems are written to stdout, one a line,
    with exit code 1.
    """
    from ogmkit.shards.verify import verify_folder

    with progress(None, "shards", "verify") as advance:
        problems = verify_folder(shards, on_progress=advance)
    for problem in problems:
        click.echo(f"{problem.file}: {problem.message}")
    if problems:
        raise click.exceptions.Exit(1)
    click.echo(f"{shards}: sound")
