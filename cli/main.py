"""The `ogmkit` command: a Click group that imports a command only when it is called."""

import importlib
import signal

import click

from ogmkit import __version__
from ogmkit.errors import OgmkitError

from .groups import SuggestingGroup
from .text import one_line

COMMANDS = {
    "synthesize": "Make a nuScenes-style dataset out of nothing.",
    "check": "Check a dataset against numbered rules.",
    "inspect": "Show what a dataset or a shard holds.",
    "extract": "Turn a dataset into training targets, one HDF5 shard a scene.",
    "verify": "Check shards against their schema, checksums and each other.",
    "homography-fit": "Fit camera-to-BEV homographies to every frame.",
    "render-footprints": "Render drivable area and vehicles as camera-view masks.",
    "train": "Train a network on shards.",
    "predict": "Predict with a trained network.",
    "evaluate": "Score trained networks by the paper's tables.",
    "run": "Make shards, networks and both tables in one go.",
    "export": "Export a trained network to ONNX.",
    "preview": "Draw contact sheets of extracted frames.",
}
"""Commands in the order of work, with the first sentence of each one's help (a test compares them)."""


RESUMABLE = {"extract", "homography-fit", "render-footprints", "train", "predict", "run"}
"""Commands that resume where they were interrupted when they are run again."""


class Failure(click.ClickException):
    """A failed run: one line on stderr and exit code 1, without usage or traceback."""

    def show(self, file: object = None) -> None:
        """Write the line to stderr, whatever stream Click offers."""
        click.echo(f"ogmkit: {one_line(self.message)}", err=True)


class Interrupted(Failure):
    """The user pressed Ctrl-C."""

    exit_code = 128 + signal.SIGINT  # as shells have it


class LazyGroup(SuggestingGroup):
    """Lists commands from `COMMANDS`; the module `<name>.py` beside this one is imported on demand."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of work."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command; None where there is none of that name."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f".{cmd_name.replace('-', '_')}", __package__)
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def invoke(self, ctx: click.Context) -> object:
        """Run a command; what it raises on purpose, or what the machine denies it, becomes one line."""
        try:
            return super().invoke(ctx)
        except OgmkitError as error:
            raise Failure(f"error: {error}") from error
        except KeyboardInterrupt as error:
            raise Interrupted(_interrupted(ctx.invoked_subcommand)) from error
        except MemoryError as error:
            raise Failure("error: out of memory; try fewer --workers or a smaller grid") from error
        except BrokenPipeError:
            raise  # Click ends quietly
        except OSError as error:
            raise Failure(f"error: {error}") from error


def _interrupted(command: str | None) -> str:
    return "interrupted; run the same command to resume" if command in RESUMABLE else "interrupted"


@click.group(
    cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(__version__, prog_name="ogmkit", message="%(prog)s %(version)s")
def main() -> None:
    """Exact bird's-eye-view ground truth from nuScenes-style datasets.

    `ogmkit COMMAND --help` describes a command.
    """
