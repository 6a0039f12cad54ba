"""`ogmkit adapt`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ogmkit.base.news import Waiting, tell

from .command import Command
from .extras import require_train
from .options import cameras_option, scenes_option, shards_split_file_option, splits_option, workers_option
from .paths import EXISTING, EXISTING_FOLDER, FOLDER
from .predict_masks import limit_option
from .progress import progress
from .text import with_number


@click.command(
    cls=Command,
    examples=(
        "ogmkit adapt runs/footprints shards --out runs/footprints-adapted --split test",
        "ogmkit adapt runs/footprints images --out runs/footprints-adapted --share 0.5",
    ),
)
@click.argument("run", type=EXISTING)
@click.argument("source", type=EXISTING_FOLDER)
@click.option("--out", type=FOLDER, metavar="FOLDER", required=True, help="Folder of the new RUN.")
@scenes_option
@splits_option
@shards_split_file_option
@cameras_option()
@limit_option
@click.option(
    "--share",
    type=click.FloatRange(0, 1, min_open=True),
    default=1.0,
    show_default=True,
    help="Weight of the images' statistics in the new ones; RUN's own have the rest.",
)
@click.option(
    "--batch-size",
    type=click.IntRange(min=2),
    default=8,
    show_default=True,
    help="Number of images whose statistics are taken together.",
)
@workers_option
def command(
    run: Path,
    source: Path,
    out: Path,
    share: float,
    batch_size: int,
    workers: int,
    **chosen: Any,  # noqa: ANN401  # the fields of `Choice`
) -> None:
    """Take a network's normalisation from images without labels.

    RUN is a folder that `ogmkit train` wrote, or a checkpoint, of a system that sees images; SOURCE a folder
    of shards, or of *.jpg and *.png. FOLDER gets a checkpoint with the same weights, whose statistics of
    batch normalisation are those of the images, or lie between them and RUN's (--share), and which says so;
    RUN stays as it is. No label is read. Options that choose frames go with shards.
    """
    require_train()
    with progress(None, "images", "adapt") as advance:
        tell(Waiting("loading torch"))
        from ogmkit.learn.predict.adapt import adapt
        from ogmkit.learn.predict.choice import Choice

        summary = adapt(
            run,
            source,
            out,
            choice=Choice(**chosen),
            share=share,
            batch_size=batch_size,
            workers=workers,
            on_progress=advance,
        )
    click.echo(
        f"{out}: {summary.system}, {with_number(summary.layers, 'layer')} of batch normalisation by "
        f"{with_number(summary.images, 'image')} of {source}, {summary.seconds:.1f} s"
    )
