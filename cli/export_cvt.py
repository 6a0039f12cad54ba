"""`ogmkit export-cvt`."""

from __future__ import annotations

from pathlib import Path

import click

from .command import Command
from .options import (
    dataroot_argument,
    scenes_option,
    split_file_option,
    splits_option,
    version_option,
    workers_option,
)
from .paths import ANY
from .progress import progress
from .text import with_number


@click.command(
    cls=Command,
    examples=(
        "ogmkit export-cvt dataroot cvt_labels_nuscenes",
        "ogmkit export-cvt dataroot cvt_labels_nuscenes --split train,val --workers 2",
    ),
)
@dataroot_argument
@click.argument("out", type=ANY)
@version_option
@scenes_option
@splits_option
@split_file_option
@workers_option
def command(
    dataroot: Path,
    out: Path,
    version: str | None,
    scenes: tuple[str, ...],
    splits: tuple[str, ...],
    split_file: Path | None,
    workers: int,
) -> None:
    """Write labels for cross_view_transformers' training code.

    OUT is its labels_dir: <scene>.json lists the samples of each scene of DATAROOT, with poses, calibration
    and image paths, <scene>/ holds their labels: twelve classes as bits of a PNG, centres, visibility. No
    camera file is read, but the map expansion is. To resume after an interruption, run the same command
    again.
    """
    from ogmkit.base.execution import Execution
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pipeline.exports.cvt import export_cvt
    from ogmkit.pipeline.selection import select_scenes

    with Dataset(dataroot, version) as dataset:
        chosen = select_scenes(dataset, scenes, splits, split_file)
        with progress(len(chosen), "scenes", "export-cvt") as advance:
            summary = export_cvt(
                dataset,
                out,
                chosen,
                splits=dataset.splits(split_file),
                execution=Execution(workers, on_progress=advance),
            )
    click.echo(
        f"{out}: {with_number(summary.rows, 'sample')} in {with_number(len(summary.files), 'scene')} "
        f"({summary.kept} already there), {summary.seconds:.1f} s"
    )
