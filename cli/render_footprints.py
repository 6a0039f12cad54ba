"""`ogmkit render-footprints`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .command import Command
from .options import cameras_option, shards_argument, workers_option
from .progress import progress
from .text import with_number

if TYPE_CHECKING:
    from ogmkit.footprints.sets import Method


@click.command(
    cls=Command,
    examples=(
        "ogmkit render-footprints shards",
        "ogmkit render-footprints shards --method full-body --scale 1",
    ),
)
@shards_argument
@click.option(
    "--homography",
    metavar="SOURCE",
    default="surface",
    show_default=True,
    help="Homography that masks are warped with; for the other methods, the ground that the drivable area "
    "lies on: surface or calibration.",
)
@click.option(
    "--method",
    type=click.Choice(["warp", "project", "full-body"]),
    default="warp",
    show_default=True,
    help="By the homography; exactly, from boxes and ground; or whole bodies, as an ordinary mask has them.",
)
@click.option(
    "--scale", type=float, default=2.0, show_default=True, help="Size of the image / size of the masks."
)
@click.option(
    "--masks",
    "name",
    metavar="SET",
    show_default="SOURCE, SOURCE-project or full-body",
    help="Name of the set of masks.",
)
@cameras_option()
@workers_option
@click.option("--overwrite", is_flag=True, help="Render an existing set again; other settings are allowed.")
def command(
    shards: Path,
    homography: str,
    method: Method,
    scale: float,
    name: str | None,
    cameras: tuple[str, ...],
    workers: int,
    overwrite: bool,
) -> None:
    """Render drivable area and vehicles as camera-view masks.

    Adds a group footprints/<set> to each camera of SHARDS, a folder that `ogmkit extract` wrote. Frames
    without a valid homography are marked, and their masks left empty. To resume after an interruption, run
    the same command again.
    """
    from ogmkit.footprints.settings import FootprintSettings
    from ogmkit.pipeline.execution import Execution
    from ogmkit.pipeline.render_footprints import render_footprints

    with progress(None, "shards", "render-footprints") as advance:
        summary = render_footprints(
            shards,
            FootprintSettings(homography, method, scale, name),
            cameras=cameras,
            execution=Execution(workers, overwrite=overwrite, on_progress=advance),
        )
    click.echo(
        f"{summary.name}: {with_number(summary.frames, 'frame')} in {with_number(summary.shards, 'shard')} "
        f"({summary.kept} had it all before), {summary.seconds:.1f} s"
    )
    if summary.invalid:
        frames = with_number(summary.invalid, "frame")
        click.echo(f"{summary.name}: no valid homography in {frames}: left empty")
