"""`ogmkit render-footprints`."""

from __future__ import annotations

from pathlib import Path

import click

from ogmkit.footprints.settings import FootprintSettings

from .command import Command
from .options import cameras_option, scheduler_option, shards_argument, workers_option
from .progress import progress
from .record_options import record_options
from .text import with_number


@click.command(
    cls=Command,
    examples=(
        "ogmkit render-footprints shards",
        "ogmkit render-footprints shards --method full-body --scale 1",
    ),
)
@shards_argument
@record_options(FootprintSettings, "settings")
@cameras_option()
@workers_option
@scheduler_option
@click.option("--overwrite", is_flag=True, help="Rebuild an existing set; other settings are allowed.")
def command(
    shards: Path,
    settings: FootprintSettings,
    cameras: tuple[str, ...],
    workers: int,
    scheduler: str,
    overwrite: bool,
) -> None:
    """Render drivable area and vehicles as camera-view masks.

    Adds a group footprints/<set> to each camera of SHARDS, a folder that `ogmkit extract` wrote. Frames
    without a valid homography are marked, and their masks left empty. To resume after an interruption, run
    the same command again.
    """
    from ogmkit.base.execution import Execution
    from ogmkit.pipeline.render_footprints import render_footprints

    with progress(None, "shards", "render-footprints") as advance:
        summary = render_footprints(
            shards,
            settings,
            cameras=cameras,
            execution=Execution(workers, scheduler, overwrite=overwrite, on_progress=advance),
        )
    click.echo(
        f"{summary.name}: {with_number(summary.frames, 'frame')} in {with_number(summary.shards, 'shard')} "
        f"({summary.kept} already complete), {summary.seconds:.1f} s"
    )
    if summary.invalid:
        frames = with_number(summary.invalid, "frame")
        click.echo(f"{summary.name}: no valid homography in {frames}: left empty")
