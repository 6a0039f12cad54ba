"""`ogmkit view`: shards and predictions in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .command import Command
from .options import cameras_option, scenes_option, shards_argument, theme_option
from .paths import EXISTING, EXISTING_FOLDER, FILE
from .progress import progress

if TYPE_CHECKING:
    from ogmkit.drawing.palette import ThemeName


@click.command(
    cls=Command,
    examples=(
        "ogmkit view shards",
        "ogmkit view shards --scenes scene-0001 --predictions predictions --save scene.rrd",
    ),
)
@shards_argument
@click.option(
    "--save", type=FILE, metavar="FILE", help="Write FILE, such as scene.rrd, instead of opening the viewer."
)
@click.option("--overwrite", is_flag=True, help="Replace FILE if it is there.")
@scenes_option
@cameras_option()
@click.option(
    "--predictions",
    type=EXISTING,
    multiple=True,
    help="What a network said: a folder that `ogmkit predict SYSTEM --out` wrote, or a file of "
    "`ogmkit predict plan --out`; repeat the option for several.",
)
@click.option(
    "--dataroot",
    type=EXISTING_FOLDER,
    help="Dataset with the images, where the shards only refer to them (--images reference).",
)
@theme_option
def command(
    shards: Path,
    save: Path | None,
    overwrite: bool,
    scenes: tuple[str, ...],
    cameras: tuple[str, ...],
    predictions: tuple[Path, ...],
    dataroot: Path | None,
    theme: ThemeName,
) -> None:
    """Show shards in the Rerun viewer, to move about in space and time.

    Records SHARDS, the folder that `ogmkit extract` wrote, with all that was added to it: images with boxes,
    footprints and homographies; rasters on the plane; LiDAR points; past and future; speed; predictions. One
    recording holds all scenes, each under its own entity path. Choose a few with --scenes: the viewer keeps
    everything it shows in memory.

    Needs `pip install 'ogmkit[view]'`. With --save, `rerun FILE` opens the recording later, also on
    another machine.

    Writes the file's name to stdout.
    """
    from ogmkit.view.view import Shown, view

    shown = Shown(scenes, cameras, predictions, dataroot, theme)
    with progress(None, "frames", "view") as advance:
        view(shards, save, shown, overwrite=overwrite, on_progress=advance)
    if save is not None:
        click.echo(save)
