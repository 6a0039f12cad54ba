"""The `ogmkit` command: a Click group that imports a command only when it is called."""

import importlib
import os
import shlex
import signal
import sys
import tempfile
import traceback
from typing import Any

import click

from ogmkit import __version__
from ogmkit.base.interrupts import interrupts_heeded
from ogmkit.errors import OgmkitError

from .command import PREFIX, bind_variables
from .groups import SuggestingGroup
from .logs import LOG, log_options
from .progress import RESUMES
from .terminal import adapt
from .text import one_line

COMMANDS = {
    "synthesize": "Generate a synthetic nuScenes-style dataset.",
    "check": "Check a dataset against numbered rules.",
    "splits": "Show how near splits lie to each other, or make some that lie apart.",
    "inspect": "Show what a dataset, shards, a training or a checkpoint holds.",
    "extract": "Turn a dataset into training targets, one HDF5 shard a scene.",
    "compare-labels": "Compare the labels of several repositories with each other and with exact ones.",
    "verify": "Check shards against their schema, checksums and each other.",
    "homography-fit": "Fit camera-to-BEV homographies to every frame.",
    "render-footprints": "Render drivable area and vehicles as camera-view masks.",
    "train": "Train a network on shards.",
    "adapt": "Take a network's normalisation from images without labels.",
    "predict": "Predict with a trained network.",
    "evaluate": "Score trained networks by the paper's tables.",
    "run": "Run the whole chain: shards, networks, both tables.",
    "export": "Export a trained network to ONNX.",
    "export-shards": "Write shards for WebDataset, Parquet or Hugging Face.",
    "export-cvt": "Write labels for cross_view_transformers' training code.",
    "preview": "Draw contact sheets of extracted frames.",
    "report": "Write one HTML file that shows what there is.",
    "view": "Show shards in the Rerun viewer, to move about in space and time.",
    "cache": "Show or clear the cache of decoded map masks.",
    "doctor": "Show what this installation has, and what it lacks for what.",
}
"""Commands in the order of work, with the first sentence of each one's help (a test compares them)."""


RESUMABLE = {
    *("extract", "homography-fit", "render-footprints", "train", "predict", "run"),
    *("export-shards", "export-cvt"),
}
"""Commands that resume where they were interrupted when they are run again."""


class Failure(click.ClickException):
    """A failed run: one line on stderr and exit code 1, without usage or traceback."""

    def show(self, file: object = None) -> None:
        """Write the line to stderr, whatever stream Click offers."""
        click.echo(f"ogmkit: {one_line(self.message)}", err=True)


class Unexpected(Failure):
    """An error of ogmkit's own, not of its input."""

    exit_code = os.EX_SOFTWARE


class Interrupted(Failure):
    """The user pressed Ctrl-C."""

    exit_code = 128 + signal.SIGINT  # as shells have it


class LazyGroup(SuggestingGroup):
    """Lists commands from `COMMANDS`; the module `<name>.py` beside this one is imported on demand."""

    def __init__(self, *arguments: Any, **attributes: Any) -> None:  # noqa: ANN401  # as of `click.Group`
        super().__init__(*arguments, **attributes)
        self.params[:0] = log_options()

    def main(self, *arguments: Any, **attributes: Any) -> Any:  # noqa: ANN401  # as of `click.Group`
        """Run the command line, on a terminal with whatever character set."""
        adapt(sys.stdout)
        adapt(sys.stderr)
        return super().main(*arguments, **attributes)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of work."""
        return list(COMMANDS)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read options, also from the environment."""
        bind_variables(self, ctx)
        return super().parse_args(ctx, args)

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
            with interrupts_heeded():
                return super().invoke(ctx)
        except BrokenPipeError:
            raise  # Click ends quietly
        except (OgmkitError, KeyboardInterrupt, MemoryError, OSError) as error:
            failure = _failure(error, ctx.invoked_subcommand)
            LOG.error(one_line(failure.message))
            raise failure from error
        except click.ClickException as error:
            LOG.error(one_line(error.format_message()))
            raise
        except (click.exceptions.Exit, click.Abort):
            raise
        except Exception as error:
            failure = Unexpected(_unexpected(error))
            LOG.error(one_line(failure.message))
            raise failure from error


def _failure(error: BaseException, command: str | None) -> Failure:
    """The line that tells of an error."""
    if isinstance(error, KeyboardInterrupt):
        return Interrupted(_interrupted(command))
    if isinstance(error, MemoryError):
        return Failure("error: out of memory; try fewer --workers or a smaller grid")
    if isinstance(error, OSError) and error.filename is not None:
        return Failure(
            f"error: {error.filename}: {error.strerror}; check the disk and permissions, then run again"
        )
    return Failure(f"error: {error}")


def _unexpected(error: Exception) -> str:
    """The line that tells of an error nobody foresaw, and of the file that keeps its traceback."""
    what = f"internal error: {type(error).__name__}: {error}"
    lines = (f"ogmkit {__version__}: {shlex.join(sys.argv[1:])}\n", *traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="ogmkit-", suffix=".txt", delete=False, encoding="utf-8", errors="backslashreplace"
        ) as file:
            file.writelines(lines)
    except OSError as refused:
        return f"{what}; its traceback can't be kept ({refused.strerror})"
    return f"{what}; please report it with its traceback, kept in {file.name}"


def _interrupted(command: str | None) -> str:
    return RESUMES if command in RESUMABLE else "interrupted"


@click.group(
    cls=LazyGroup,
    examples=("ogmkit synthesize world", "ogmkit -v --log-file extract.log extract world shards"),
    context_settings={
        "help_option_names": ["-h", "--help"],
        "max_content_width": 100,
        "auto_envvar_prefix": PREFIX,
    },
)
@click.version_option(
    __version__, prog_name="ogmkit", message="%(prog)s %(version)s", allow_from_autoenv=False
)
def main() -> None:
    """Exact bird's-eye-view ground truth from nuScenes-style datasets.

    `ogmkit COMMAND --help` describes a command. Options may also come from environment variables: those of
    `ogmkit extract` from OGMKIT_EXTRACT_…, such as OGMKIT_EXTRACT_WORKERS for --workers, those of `ogmkit
    train oft` from OGMKIT_TRAIN_OFT_…. Options on the command line take precedence. -v, -q and --log-file may
    stand before or after COMMAND.
    """
