"""`ogmkit evaluate`: the paper's IoU table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import cameras_option, shards_split_file_option
from .progress import progress
from .text import text_table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.evaluation.report import Table
    from ogmkit.evaluation.result import Evaluation

FORMATS = ("text", "markdown", "csv", "json", "latex")
PICTURE_FRAMES = 4
"""Frames that a picture of a run shows."""


@click.command()
@click.argument("shards", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.argument("runs", metavar="[RUN]...", type=click.Path(exists=True, path_type=Path), nargs=-1)
@click.option("--split", metavar="NAME", default="val", show_default=True, help="Split to evaluate on.")
@shards_split_file_option
@click.option(
    "--homography",
    metavar="SOURCE",
    show_default="network if there, else surface",
    help="Homographies that masks in camera view are warped by.",
)
@cameras_option()
@click.option(
    "--threshold",
    type=click.FloatRange(0, 1, max_open=True),
    default=0.5,
    show_default=True,
    help="Probability above which a cell counts as predicted.",
)
@click.option(
    "--scale",
    type=float,
    default=2.0,
    show_default=True,
    help="Image size / mask size of the ceilings' true masks.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(FORMATS),
    default="text",
    show_default=True,
    help="How to write the result to stdout; csv and json hold a row a figure.",
)
@click.option(
    "--pictures",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Folder for a PNG of each RUN: images with masks, predictions and truth.",
)
@click.option(
    "--batch-size", type=click.IntRange(min=1), default=8, show_default=True, help="Frames at a time."
)
@click.option(
    "--workers",
    type=click.IntRange(min=0),
    default=2,
    show_default=True,
    help="Processes that read for the networks; 0 reads in this one.",
)
@click.option(
    "--limit-frames",
    "limit",
    type=click.IntRange(min=1),
    show_default="all",
    help="Frames of each split, evenly spread.",
)
def command(
    shards: Path,
    runs: tuple[Path, ...],
    split: str,
    split_file: Path | None,
    homography: str | None,
    cameras: tuple[str, ...],
    threshold: float,
    scale: float,
    form: str,
    pictures: Path | None,
    batch_size: int,
    workers: int,
    limit: int | None,
) -> None:
    """Score trained networks by the paper's IoU table.

    SHARDS is a folder that `ogmkit extract` wrote; each RUN a folder that `ogmkit train` wrote, of which the
    best checkpoint is taken, or a checkpoint. Drivable area and vehicles; in camera view, where a system has
    one, and in BEV: full, close (up to 50 m ahead, 10 m to each side) and far (over 50 m ahead); IoU of the
    foreground and its mean with the background's; all cells and the field of view only. Intervals come from
    resampling scenes.

    \b
    Rows that need no RUN, and stand below:
    all-drivable       drivable everywhere, vehicles nowhere
    mean-map           the mean of the split train, by camera
    ceiling-SOURCE     true footprints, warped by a homography: what it alone costs
    ceiling-full-body  true whole bodies, warped alike: what the stretch alone costs

    A second table says how often connected components tell neighbouring vehicles apart.
    """  # noqa: D301  # Click wants the character  # noqa: D301  # Click wants the character
    if pictures is not None and not runs:
        raise click.UsageError("--pictures needs a RUN.")
    if runs:
        from .extras import require_train

        require_train()
    from ogmkit.evaluation.evaluate import evaluate

    if pictures is not None:
        from ogmkit.pictures.evaluation_sheet import make_folder

        make_folder(pictures, shards)
    with progress(None, "frames", "evaluate") as advance:
        evaluation = evaluate(
            shards,
            runs,
            split=split,
            split_file=split_file,
            homography=homography,
            cameras=cameras,
            threshold=threshold,
            scale=scale,
            batch_size=batch_size,
            workers=workers,
            limit=limit,
            samples=0 if pictures is None else PICTURE_FRAMES,
            on_progress=advance,
        )
    click.echo(_written(evaluation, form), nl=False)
    if pictures is not None:
        from ogmkit.pictures.evaluation_sheet import draw_evaluation

        for path in draw_evaluation(shards, evaluation, pictures):
            click.echo(path, err=True)


def _written(evaluation: Evaluation, form: str) -> str:
    """The evaluation in a format."""
    from ogmkit.evaluation import formats

    if form == "text":
        return "".join(f"{line}\n" for line in _text_lines(evaluation))
    writers = {
        "markdown": formats.as_markdown,
        "csv": formats.as_csv,
        "json": formats.as_json,
        "latex": formats.as_latex,
    }
    return writers[form](evaluation)


def _text_lines(evaluation: Evaluation) -> Iterator[str]:
    from ogmkit.evaluation.report import explanations, heading, separation_table, tables

    yield heading(evaluation)
    for table in (*tables(evaluation), separation_table(evaluation)):
        yield ""
        yield table.title
        yield from _table_lines(table)
    yield ""
    yield from explanations(evaluation)


def _table_lines(table: Table) -> Iterator[str]:
    """A table with its groups above and a rule over its fixed rows."""
    rows = (*table.systems, *table.fixed)
    widths = [max(len(line[column]) for line in (table.header, *rows)) for column in range(len(table.header))]

    def aligned(line: tuple[str, ...]) -> list[str]:
        return [line[0], *(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True))]

    header, *lines = text_table(aligned(table.header), [aligned(row) for row in rows]).splitlines()
    left = widths[0] + 2
    above = " " * left
    first = 1
    for text, columns in table.groups:
        width = sum(widths[first : first + columns]) + 2 * (columns - 1)
        above += f" {text} ".center(width, "-") + "  "
        first += columns
    if table.groups:
        yield above.rstrip()
    yield header
    yield from lines[: len(table.systems)]
    if table.systems:
        yield "-" * max(map(len, lines))
    yield from lines[len(table.systems) :]
