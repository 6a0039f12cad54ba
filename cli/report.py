"""`ogmkit report`: one page of what shards, trainings and tables hold."""

from __future__ import annotations

from pathlib import Path

import click

from ogmkit.report.settings import ReportSettings

from .command import Command
from .options import workers_option
from .paths import EXISTING, EXISTING_FOLDER, FILE
from .progress import progress
from .record_options import record_options


@click.command(
    cls=Command,
    examples=(
        "ogmkit report shards --out report.html",
        "ogmkit report shards runs/* table.json --out report.html --frames 6 --workers 4",
    ),
)
@click.argument("paths", metavar="PATH...", type=EXISTING, nargs=-1, required=True)
@click.option("--out", type=FILE, metavar="FILE", required=True, help="HTML file to write.")
@record_options(ReportSettings, "settings")
@click.option(
    "--dataroot",
    type=EXISTING_FOLDER,
    help="Dataset to check, with the images that shards only refer to.  "
    "[default: where the shards were made from]",
)
@workers_option
def command(
    paths: tuple[Path, ...], out: Path, settings: ReportSettings, dataroot: Path | None, workers: int
) -> None:
    """Write one HTML file that shows what there is.

    Each PATH is a folder that `ogmkit extract` wrote (one of them at most), a RUN that `ogmkit train` wrote,
    a table that `ogmkit evaluate --format json` wrote, or the folder of `ogmkit run`, which has all of these.

    The file needs nothing beside it and no network: what was extracted, with which settings; what
    `ogmkit verify` finds in the shards, and `ogmkit check` in the dataset, where that is there;
    distributions; frames to leaf through, by scene, camera, what they lack and the IoU of runs; where runs go
    wrong; errors of homographies; training curves; both tables, sortable, with their intervals.

    Of RUNs that predict grids, examples need torch; without it they are left out.

    Writes the file's name to stdout.
    """
    from ogmkit.report.opened import grid_runs
    from ogmkit.report.report import Means, write_report
    from ogmkit.report.sources import sources_of

    sources = sources_of(paths)
    if sources.runs:
        from .extras import require_yaml

        require_yaml()
    with progress(None, "steps", "report") as advance:
        predicts = settings.examples and sources.shards is not None
        means = Means(grid_runs(sources.runs) if predicts else (), dataroot, workers, advance)
        write_report(out, sources, settings, means)
    click.echo(out)
