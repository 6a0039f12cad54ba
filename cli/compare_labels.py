"""`ogmkit compare-labels`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ogmkit.labels.names import NAMES

from .command import Command
from .options import (
    dataroot_argument,
    json_option,
    list_option,
    scenes_option,
    split_file_option,
    splits_option,
    theme_option,
    version_option,
)
from .paths import ANY
from .progress import progress
from .text import json_text, lines_text, text_table, with_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.drawing.palette import ThemeName
    from ogmkit.evaluation.label_comparison import LabelComparison, LabelRow

_HEADER = ("label", "beside", "class", "cells", "beside's", "area", "IoU")


@click.command(
    cls=Command,
    examples=(
        "ogmkit compare-labels dataroot --definition lss --definition cvt",
        "ogmkit compare-labels dataroot --definition fiery,pointbev --no-map --picture labels.png",
    ),
)
@dataroot_argument
@list_option(
    "--definition",
    "definitions",
    choices=NAMES,
    required=True,
    metavar="NAME,…",
    help=f"Labels to compare: {', '.join(NAMES)}.",
)
@version_option
@scenes_option
@splits_option
@split_file_option
@click.option("--no-map", is_flag=True, help="Leave out classes that need the map expansion.")
@click.option("--picture", type=ANY, help="PNG file of the key frame where the first one is farthest off.")
@theme_option
@json_option
def command(
    dataroot: Path,
    definitions: tuple[str, ...],
    version: str | None,
    scenes: tuple[str, ...],
    splits: tuple[str, ...],
    split_file: Path | None,
    no_map: bool,
    picture: Path | None,
    theme: ThemeName,
    as_json: bool,
) -> None:
    """Compare the labels of several repositories with each other and with exact ones.

    Each definition is drawn for every key frame of DATAROOT and laid beside `exact`, the raster of the same
    frame, grid, classes and filters where a cell counts if its centre is inside, and beside each other one
    whose array covers the same cells. No camera file is needed. Of the paper's, vehicles are drawn alone.

    Fields of --json: frames, worst (scene, key frame), apart (pairs without cells in common), rows (one,
    other, label: the class, range, cells, other_cells, iou, area_ratio, shift, shifted_iou).
    """
    from ogmkit.evaluation.label_comparison import compare_labels
    from ogmkit.labels.catalogue import drawable
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pipeline.selection import select_scenes

    drawn = [drawable(name, no_map=no_map) for name in definitions]
    with Dataset(dataroot, version) as dataset:
        names = select_scenes(dataset, scenes, splits, split_file)
        with progress(len(names), "scenes", "compare-labels") as advance:
            found = compare_labels(dataset, names, drawn, on_progress=advance)
        if picture is not None:
            from ogmkit.drawing.palette import themed
            from ogmkit.pictures.labels_sheet import draw_disagreement

            with themed(theme):
                draw_disagreement(picture, dataset, found.worst, drawn)
    click.echo(json_text(found) if as_json else lines_text(_lines(found)))


def _lines(found: LabelComparison) -> Iterator[str]:
    from ogmkit.labels.compare import RANGES

    yield f"{with_number(found.frames, 'key frame')}; area: cells / beside's"
    yield ""
    ranges = list(RANGES)[1:]
    lines = [_line(rows, ranges) for rows in _by_class(found).values()]
    yield from text_table((*_HEADER, *ranges, "shift", "IoU then"), lines).split("\n")
    for one, other in found.apart:
        yield f"{one} and {other} have no cells in common"


def _by_class(found: LabelComparison) -> dict[tuple[str, str, str], dict[str, LabelRow]]:
    """Pair and class → range → row."""
    rows: dict[tuple[str, str, str], dict[str, LabelRow]] = {}
    for row in found.rows:
        rows.setdefault((row.one, row.other, row.label), {})[row.range] = row
    return rows


def _line(rows: dict[str, LabelRow], ranges: list[str]) -> tuple[object, ...]:
    whole = rows["all"]
    shift = "–" if math.isnan(whole.shifted_iou) else ", ".join(f"{cells:+d}" for cells in whole.shift)
    return (
        *(whole.one, whole.other, whole.label, whole.cells, whole.other_cells),
        *(_figure(whole.area_ratio), _figure(whole.iou), *(_figure(rows[name].iou) for name in ranges)),
        *(shift, _figure(whole.shifted_iou)),
    )


def _figure(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3f}"
