"""`ogmkit train`."""

from __future__ import annotations

from pathlib import Path

import click

from .progress import progress
from .text import with_number
from .train_options import setting_options

SYSTEMS = ("homography", "footprints", "ved", "oft", "bev-lidar")
PLANNERS = ("lstm-ed", "end-to-end", "mid-to-end", "holistic", "holistic-cv")


_CONFIGURED = "ogmkit.train.system"
"""Where the context keeps the system that a configuration is of."""
_NO_SETTINGS = {"config", "print_config", "shards", "run", "split_file", "overwrite", "help"}


def _configured(context: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    """Take a YAML file's values as defaults of the options."""
    del parameter
    if path is None:
        return
    from .extras import require_train

    require_train()
    from ogmkit.base.names import unknown
    from ogmkit.errors import SettingsError
    from ogmkit.learn.runs import read_yaml

    known = {str(option.name) for option in context.command.params} - _NO_SETTINGS
    values = read_yaml(path)
    context.meta[_CONFIGURED] = values.pop("system", None)
    for name in values:
        if name not in known:
            raise SettingsError(f"{path}: {unknown('setting', name, sorted(known))}")
    context.default_map = {name: value for name, value in values.items() if value is not None}


@click.command()
@click.argument("system", type=click.Choice((*SYSTEMS, *PLANNERS)))
@click.argument("shards", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "--out",
    "run",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="RUN",
    help="Folder for checkpoints, figures and pictures; needed, except with --print-config.",
)
@click.option(
    "--config",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    is_eager=True,
    expose_value=False,
    callback=_configured,
    help="YAML file of settings, as --print-config writes it; options take precedence.",
)
@click.option("--print-config", is_flag=True, help="Write the settings as YAML, and train nothing.")
@setting_options
@click.option("--overwrite", is_flag=True, help="Begin anew where RUN holds a training already.")
def command(
    system: str,
    shards: Path,
    run: Path | None,
    print_config: bool,
    split_file: Path | None,
    overwrite: bool,
    **values: object,  # the other settings, by their names
) -> None:
    """Train a network on shards.

    \b
    SYSTEM is one of
    homography  image → homography to BEV; learns a source of `ogmkit homography-fit`
    footprints  image → masks in camera view, warped to BEV: the paper's
    ved         image → BEV through a variational bottleneck, one model a target
    oft         image → BEV through the Orthographic Feature Transform
    bev-lidar   LiDAR from above → BEV

    \b
    or a planner, from sequences of six frames to the next 2.5 s, given the destination after 3 s
    lstm-ed     from the past trajectory alone
    end-to-end  from images
    mid-to-end  from true masks on the plane
    holistic    from images through footprints, warped to the plane: the paper's
    holistic-cv the same without the warp

    SHARDS is a folder that `ogmkit extract` wrote. The defaults are the paper's. RUN gets config.yaml,
    splits.json, metrics.csv, tensorboard/, samples.png, last.ckpt and best.ckpt. Ctrl-C finishes the step and
    saves; the same command again goes on where it stopped, exactly.
    """  # noqa: D301  # Click wants the character
    from .extras import require_train

    require_train()
    from ogmkit.learn.runs import as_yaml
    from ogmkit.learn.settings import TrainSettings

    configured = click.get_current_context().meta.get(_CONFIGURED, system)
    if configured != system:
        raise click.UsageError(f"--config is of {configured}, not of {system}.")
    settings = TrainSettings.from_dict({"system": system, **values})
    if print_config:
        click.echo(as_yaml(settings), nl=False)
        return
    if run is None:
        raise click.UsageError("Missing option '--out'.")
    from ogmkit.learn.training import train

    with progress(None, "steps", f"train {system}") as advance:
        summary = train(
            settings, shards, run, split_file=split_file, overwrite=overwrite, on_progress=advance
        )
    if summary is None:
        return  # the first process tells
    resumed = f", went on at step {summary.resumed_step:,}" if summary.resumed_step else ""
    score = "" if summary.score is None else f", best {summary.score_name} {summary.score:.4g}"
    sample = "sequence" if system in PLANNERS else "frame"
    click.echo(
        f"{run}: {summary.system}, {with_number(summary.steps, 'step')} on "
        f"{with_number(summary.frames, sample)}{score} on {with_number(summary.val_frames, sample)}"
        f"{resumed}, {summary.seconds:.1f} s"
    )
