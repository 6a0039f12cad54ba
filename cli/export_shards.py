"""`ogmkit export-shards`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .command import Command
from .options import shards_argument, workers_option
from .paths import ANY
from .progress import progress
from .text import with_number

if TYPE_CHECKING:
    from ogmkit.pipeline.exports.export import ExportFormat


@click.command(
    cls=Command,
    examples=(
        "ogmkit export-shards shards tars --format webdataset",
        "ogmkit export-shards shards dataset --format hf --workers 2",
    ),
)
@shards_argument
@click.argument("out", type=ANY)
@click.option(
    "--format",
    "form",
    type=click.Choice(("webdataset", "parquet", "hf")),
    required=True,
    help="Tar files, Parquet files, or Parquet with the card of a Hugging Face dataset.",
)
@workers_option
def command(shards: Path, out: Path, form: ExportFormat, workers: int) -> None:
    """Write shards for WebDataset, Parquet or Hugging Face.

    Each scene of SHARDS, a folder that `ogmkit extract` wrote, becomes OUT/cameras/<scene>, a sample or row
    for each frame of each camera, and OUT/surround/<scene>, one for each key frame of labels round the
    vehicle. Values are those of the shards; rasters and images are PNG and JPEG files. OUT/export.json lists
    the files with checksums and splits. To resume after an interruption, run the same command again.
    """
    from ogmkit.base.execution import Execution
    from ogmkit.pipeline.exports.export import export_shards

    with progress(None, "scenes", "export-shards") as advance:
        summary = export_shards(shards, out, form, execution=Execution(workers, on_progress=advance))
    click.echo(
        f"{out}: {with_number(summary.rows, 'row')} in {with_number(len(summary.files), 'file')} "
        f"({summary.kept} already there), {summary.bytes / 1e6:.1f} MB, {summary.seconds:.1f} s"
    )
