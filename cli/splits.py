"""`ogmkit splits`: how near splits lie to each other, and splits that lie apart."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from ogmkit.base.stated import stated_fields
from ogmkit.nuscenes.disjoint_settings import DisjointSettings

from .command import Command
from .options import dataroot_argument, json_option, split_file_option, version_option
from .paths import FILE
from .record_options import record_options
from .text import json_text, lines_text, text_table, with_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.nuscenes.split_report import SplitReport


@click.command(
    cls=Command,
    examples=(
        "ogmkit splits dataroot",
        "ogmkit splits dataroot --out apart.json --apart 30 --seed 1",
    ),
)
@dataroot_argument
@version_option
@split_file_option
@click.option(
    "--near",
    "near_m",
    type=click.FloatRange(min=0),
    default=5.0,
    show_default=True,
    metavar="METRES",
    help="Distance up to which a key frame is near one of another split.",
)
@click.option(
    "--out",
    type=FILE,
    help="Divide the scenes into splits that lie apart, and write them to this JSON file, a --split-file.",
)
@record_options(DisjointSettings, "settings")
@json_option
@click.pass_context
def command(
    context: click.Context,
    dataroot: Path,
    version: str | None,
    split_file: Path | None,
    near_m: float,
    out: Path | None,
    settings: DisjointSettings,
    as_json: bool,
) -> None:
    """Show how near splits lie to each other, or make some that lie apart.

    A network that has seen a place is tested on what it remembers: over 80 % of nuScenes' validation frames
    lie within 5 m of a training frame. This reads poses alone. Of any two splits it shows what share of the
    key frames of one lies near one of the other, and the median distance to the nearest; frames on two maps
    are not near each other.

    With --out, scenes whose ways come near each other stay together; where that makes too large a zone, it is
    cut, and the scenes at the cut are left out. The file serves as --split-file of all commands.

    Fields of --json: near_m, splits (a list: name, scenes, frames, locations, tags), pairs (a list: of, to,
    frames, near_share, median_m: null where over half have none on their map), left_out (scenes in no split).
    """
    from ogmkit.base.atomic import write_json
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.nuscenes.disjoint import divide_by_place
    from ogmkit.nuscenes.split_report import report_splits

    _require_meaning(context, out, split_file)
    with Dataset(dataroot, version) as dataset:
        places = dataset.places()
        splits = dataset.splits(split_file) if out is None else divide_by_place(places, settings).splits
    report = report_splits(places, splits, near_m)
    if out is not None:
        write_json(out, splits)
    click.echo(json_text(report) if as_json else lines_text(_lines(report)))


def _require_meaning(context: click.Context, out: Path | None, split_file: Path | None) -> None:
    """Refuse options that would do nothing."""
    if out is not None and split_file is not None:
        raise click.UsageError("--out makes splits of its own: leave out --split-file.")
    for name, stated in stated_fields(DisjointSettings).items():
        if out is None and context.get_parameter_source(name) is not ParameterSource.DEFAULT:
            raise click.UsageError(f"{stated.flags(name)[0]} needs --out.")


def _lines(report: SplitReport) -> Iterator[str]:
    """The report as text."""
    tags = tuple(report.splits[0].tags) if report.splits else ()
    sizes = [
        (one.name, one.scenes, one.frames, *one.tags.values(), _places(one.locations))
        for one in report.splits
    ]
    yield from text_table(("split", "scenes", "key frames", *tags, "maps"), sizes).split("\n")
    if report.left_out:
        yield f"in no split: {with_number(len(report.left_out), 'scene')}"
    if report.pairs:
        yield ""
        near = f"within {report.near_m:g} m"
        pairs = [
            (one.of, one.to, f"{100 * one.near_share:.1f} %", _distance(one.median_m)) for one in report.pairs
        ]
        yield from text_table(("key frames of", "to those of", near, "median"), pairs).split("\n")


def _distance(median_m: float) -> str:
    return f"{median_m:.1f} m" if math.isfinite(median_m) else "other maps"


def _places(locations: dict[str, int]) -> str:
    return ", ".join(f"{name or '?'} {count}" for name, count in locations.items())
