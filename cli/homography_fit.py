"""`ogmkit homography-fit`."""

from __future__ import annotations

from pathlib import Path

import click

from ogmkit.drawing.palette import ThemeName
from ogmkit.homography.settings import FitSettings
from ogmkit.homography.sources import METHOD_NAMES

from .command import Command
from .homography_table import summary_lines, summary_values
from .options import (
    cameras_option,
    json_option,
    list_option,
    scheduler_option,
    shards_argument,
    theme_option,
    workers_option,
)
from .paths import FILE
from .progress import progress
from .record_options import record_options
from .text import json_text


@click.command(
    cls=Command,
    examples=(
        "ogmkit homography-fit shards --plot errors.png",
        "ogmkit homography-fit shards --method surface,robust --workers 8",
    ),
)
@shards_argument
@list_option(
    "--method",
    "methods",
    choices=METHOD_NAMES,
    metavar="METHOD,…",
    default=("surface", "dlt", "plane", "calibration"),
    show_default=True,
    help="How to find the homography: surface, dlt, robust, plane, four-point, calibration or ego-plane; "
    "repeat the option or separate methods by commas.",
)
@cameras_option()
@record_options(FitSettings, "settings")
@workers_option
@scheduler_option
@click.option("--overwrite", is_flag=True, help="Refit existing homographies; other settings are allowed.")
@click.option(
    "--plot",
    type=FILE,
    metavar="FILE",
    help="PNG, SVG or PDF file for a plot of the errors by method and distance.",
)
@theme_option
@json_option
def command(
    shards: Path,
    methods: tuple[str, ...],
    cameras: tuple[str, ...],
    settings: FitSettings,
    workers: int,
    scheduler: str,
    overwrite: bool,
    plot: Path | None,
    theme: ThemeName,
    as_json: bool,
) -> None:
    """Fit camera-to-BEV homographies to every frame.

    Adds a group homography/<method> to each camera of SHARDS, a folder that `ogmkit extract`
    wrote, and shows the errors of each method: each box is left out of a fit and measured. `surface`,
    `calibration` and `ego-plane` ignore the options on corners. A frame for which a method has no answer is
    marked invalid, with the reason. To resume after an interruption, run the same command again.

    Fields of --json: shards, kept (shards that already complete), seconds, methods (a list: method, frames,
    valid, residual_px and residual_cells (medians), left_out (by distance: from_m, to_m, boxes, median_m,
    p90_m, refused_share), invalid (reason, frames)). What was not measured is null.
    """
    from ogmkit.base.execution import Execution
    from ogmkit.pipeline.homography_fit import fit_shards

    if plot is not None:
        from ogmkit.base.atomic import require_outside

        require_outside(plot, shards)
    with progress(None, "shards", "homography-fit") as advance:
        summary = fit_shards(
            shards,
            methods,
            settings,
            cameras=cameras,
            execution=Execution(workers, scheduler, overwrite=overwrite, on_progress=advance),
        )
    click.echo(json_text(summary_values(summary)) if as_json else "\n".join(summary_lines(summary)))
    if plot is not None:
        from ogmkit.drawing.palette import themed
        from ogmkit.pictures.homography_plot import write_plot

        with themed(theme):
            write_plot(plot, summary)
