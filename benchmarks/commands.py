"""What the benchmarks of trained networks share: commands of ogmkit, a core each."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

from ogmkit_cli.main import main

OGMKIT = str(Path(sys.executable).with_name("ogmkit"))


def ogmkit(*arguments):
    """Run a command; what it prints goes to stderr."""
    command = [OGMKIT, *map(str, arguments)]
    print("$ ogmkit", *command[1:], file=sys.stderr, flush=True)
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    subprocess.run(command, check=True, env=environment, stdout=sys.stderr)


def ogmkit_here(*arguments):
    """Run a command in this process, which saves importing torch; what it prints goes to stderr.

    Raises:
        click.ClickException: it failed.
    """
    words = [str(one) for one in arguments]
    print("$ ogmkit", *words, file=sys.stderr, flush=True)
    with contextlib.redirect_stdout(sys.stderr):
        main.main(words, prog_name="ogmkit", standalone_mode=False)
