"""`ogmkit train SYSTEM`: one command for each system of the catalogue."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ogmkit.base.news import Waiting, tell
from ogmkit.learn.catalogue import CATALOGUE, SystemEntry, require_read
from ogmkit.learn.presets import PRESETS, preset_values

from .groups import SuggestingGroup
from .options import shards_argument, shards_split_file_option
from .paths import EXISTING_FILE, FOLDER
from .progress import progress
from .record_options import setting_options
from .text import with_number
from .train_options import TrainCommand

_HELP = """Train {system}: {help}.

SHARDS is a folder that `ogmkit extract` wrote, or s3://BUCKET/FOLDER. The defaults are the paper's. RUN gets
config.yaml, splits.json, metrics.csv, tensorboard/, samples.png, last.ckpt and best.ckpt. Ctrl-C finishes the
step and saves. To resume, run the same command again; on a CPU, the weights are the same as without the
interruption.
"""
_EXAMPLES = (
    "ogmkit train {system} shards --out runs/{system}",
    "ogmkit train {system} shards --out runs/quick --preset fast --limit-frames 200",
)


class TrainGroup(SuggestingGroup):
    """A command for each system of the catalogue."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The systems, in the order of work."""
        del ctx
        return list(CATALOGUE)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command that trains a system; None where there is none of that name."""
        del ctx
        return system_command(CATALOGUE[cmd_name]) if cmd_name in CATALOGUE else None


@click.group(
    cls=TrainGroup,
    subcommand_metavar="SYSTEM SHARDS [OPTIONS]",
    examples=(
        "ogmkit train footprints shards --out runs/footprints",
        "ogmkit train holistic shards --out runs/holistic --perception runs/footprints",
    ),
)
def command() -> None:
    """Train a network on shards.

    `ogmkit train SYSTEM --help` lists the settings that SYSTEM reads.
    """


def _configured(context: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    """Take a YAML file's values as defaults of the options."""
    del parameter
    if path is None:
        return
    from .extras import require_train

    require_train()
    from ogmkit.errors import SettingsError
    from ogmkit.learn.yaml_files import read_yaml

    entry = CATALOGUE[str(context.info_name)]
    values = read_yaml(path)
    configured = values.pop("system", entry.name)
    if configured != entry.name:
        raise click.UsageError(f"--config is of {configured}, not of {entry.name}.")
    try:
        require_read(entry, values)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}") from error
    settings = entry.settings.from_values(values, str(path))
    chosen = {name: getattr(settings, name) for name in values if values[name] is not None}
    context.default_map = {**(context.default_map or {}), **chosen}


def _preset(context: click.Context, parameter: click.Parameter, name: str | None) -> None:
    """Take a preset's values as defaults of the options; those of --config come before them."""
    del parameter
    if name is not None:
        values = preset_values(CATALOGUE[str(context.info_name)], name)
        context.default_map = {**values, **(context.default_map or {})}


def system_command(entry: SystemEntry) -> TrainCommand:
    """The command that trains one system."""

    @click.command(
        entry.name,
        cls=TrainCommand,
        short_help=entry.help,
        help=_HELP.format(system=entry.name, help=entry.help),
        examples=tuple(example.format(system=entry.name) for example in _EXAMPLES),
    )
    @shards_argument
    @click.option(
        "--out",
        "run",
        type=FOLDER,
        metavar="RUN",
        help="Folder for checkpoints, figures and pictures; needed, except with --print-config.",
    )
    @click.option(
        "--config",
        type=EXISTING_FILE,
        is_eager=True,
        expose_value=False,
        callback=_configured,
        help="YAML file of settings, as --print-config writes it; options take precedence.",
    )
    @click.option(
        "--preset",
        type=click.Choice(tuple(PRESETS)),
        is_eager=True,
        expose_value=False,
        callback=_preset,
        help="Settings that go together, in docs/settings.md; options and --config take precedence.",
    )
    @click.option("--print-config", is_flag=True, help="Write the settings as YAML, and train nothing.")
    @setting_options(entry.settings)
    @shards_split_file_option
    @click.option("--overwrite", is_flag=True, help="Start over if RUN holds a training.")
    def train_system(**arguments: Any) -> None:  # noqa: ANN401  # of `_train`
        _train(entry, **arguments)

    train_system.entry = entry
    return train_system


def _train(
    entry: SystemEntry,
    shards: Path,
    run: Path | None,
    print_config: bool,
    split_file: Path | None,
    overwrite: bool,
    **values: object,  # the settings, by their names
) -> None:
    from .extras import require_train

    require_train()
    from ogmkit.learn.yaml_files import as_yaml

    settings = entry.settings.from_values(values)
    if print_config:
        click.echo(as_yaml(settings), nl=False)
        return
    if run is None:
        raise click.UsageError("Missing option '--out'.")
    from ogmkit.learn.training.plan import plan_training

    plan_training(settings, shards, run, split_file=split_file, overwrite=overwrite)  # before torch
    with progress(None, "steps", f"train {entry.name}") as advance:
        tell(Waiting("loading torch"))
        from ogmkit.learn.training.train import train

        summary = train(
            settings, shards, run, split_file=split_file, overwrite=overwrite, on_progress=advance
        )
    if summary is None:
        return  # the first process tells
    resumed = f", resumed at step {summary.resumed_step:,}" if summary.resumed_step else ""
    score = "" if summary.score is None else f", best {summary.score_name} {summary.score:.4g}"
    sample = "sequence" if entry.plans else "frame"
    click.echo(
        f"{run}: {summary.system}, {with_number(summary.steps, 'step')} on "
        f"{with_number(summary.frames, sample)}{score} on {with_number(summary.val_frames, sample)}"
        f"{resumed}, {summary.seconds:.1f} s"
    )
