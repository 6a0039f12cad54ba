"""`ogmkit evaluate`: the paper's two tables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ogmkit.drawing.palette import ThemeName, themed
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.labels.names import NAMES, PAPER

from .command import Command
from .evaluate_written import ROWS, label_table, written
from .logs import note
from .options import cameras_option, shards_split_file_option, theme_option, workers_option
from .paths import EXISTING, EXISTING_FILE, FOLDER, SHARDS
from .progress import progress
from .record_options import record_options

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ogmkit.evaluation.planning.result import PlanEvaluation
    from ogmkit.evaluation.result import Evaluation
    from ogmkit.learn.predict.run import Run

FORMATS = ("text", "markdown", *ROWS, "latex")
PICTURE_FRAMES = 4
"""Frames that a picture of a run shows."""


@dataclass(frozen=True)
class _Call:
    """What both tables share.

    Attributes:
        shards: the folder.
        settings: how runs are scored.
        common: other arguments of either evaluation.
        form: the format on stdout.
        all_tables: False writes the headline alone.
        pictures: folder for pictures; None draws none.
    """

    shards: Path
    settings: EvaluateSettings
    common: dict[str, Any]
    form: str
    all_tables: bool
    pictures: Path | None

    def write(self, evaluation: Evaluation | PlanEvaluation) -> None:
        """Write a table to stdout."""
        click.echo(written(evaluation, self.form, self.all_tables), nl=False)

    def name(self, pictures: Iterable[Path]) -> None:
        """Name the pictures on stderr, as they are drawn."""
        for path in pictures:
            note(str(path))


@click.command(
    cls=Command,
    examples=(
        "ogmkit evaluate shards runs/footprints runs/oft --pictures sheets",
        "ogmkit evaluate shards runs/holistic --format json",
    ),
)
@click.argument("shards", type=SHARDS)
@click.argument("runs", metavar="[RUN]...", type=EXISTING, nargs=-1)
@shards_split_file_option
@record_options(EvaluateSettings, "settings")
@cameras_option()
@click.option("--all", "all_tables", is_flag=True, help="Write all tables, not the headline alone.")
@click.option(
    "--format",
    "form",
    type=click.Choice(FORMATS),
    default="text",
    show_default=True,
    help="How to write the result to stdout; csv and json hold every figure, a row each, of one stage.",
)
@click.option(
    "--pictures",
    type=FOLDER,
    metavar="DIR",
    help="Folder for a PNG of each RUN: images, predictions and truth.",
)
@click.option(
    "--definition",
    type=click.Choice(NAMES),
    default=PAPER,
    show_default=True,
    help="Labels that --predictions are scored by; RUNs are scored by the default.",
)
@click.option(
    "--predictions",
    type=EXISTING_FILE,
    multiple=True,
    help="Grids of another network, HDF5 or npz: sample_token (N), and (N, rows, columns) for each class; "
    "repeat the option for several rows.",
)
@theme_option
@workers_option
def command(
    shards: Path,
    runs: tuple[Path, ...],
    split_file: Path | None,
    settings: EvaluateSettings,
    cameras: tuple[str, ...],
    all_tables: bool,
    form: str,
    pictures: Path | None,
    definition: str,
    predictions: tuple[Path, ...],
    theme: ThemeName,
    workers: int,
) -> None:
    """Score trained networks by the paper's tables.

    Grids by IoU, plans by displacement. SHARDS is a folder that `ogmkit extract` wrote; each RUN a folder
    that `ogmkit train` wrote, whose best checkpoint is used, or a checkpoint. Runs that predict grids
    go to the first table, as do the rows that need no RUN; planners to the second. 95 % intervals come from
    resampling scenes, and need more than one.

    Reported are the scenes of split test. Without boxes there, val is reported, and `ogmkit train` chooses
    its checkpoint by some logs of train; where train has too few, val does both, and a line says so.

    Grids: IoU of drivable area and vehicles; in camera view, where a system has one, and in BEV: full, close
    (up to 50 m ahead, 10 m to each side) and far (over 50 m ahead). The table has the foreground's IoU over
    all cells; --all adds intervals, its mean with the background's, cells in the field of view only, and how
    often connected components tell neighbouring vehicles apart.

    \b
    Rows that need no RUN, below the others:
    all-drivable       drivable everywhere, vehicles nowhere
    mean-map           the mean of the scenes to learn from, by camera
    mean-mask          their mean mask in camera view, warped as networks' masks are
    ceiling-SOURCE     true footprints warped by a homography: the error of the homography alone
    ceiling-full-body  true whole bodies warped likewise: the error of the stretch alone

    Plans: ADE, L1 longitudinal and lateral at 0.5, 1.5 and 2.5 s. --all adds intervals, the means up to these
    horizons, the likelihood of the truth, how many truths the distributions' ellipses hold, and how many
    predicted points are off the drivable area or in a vehicle. It adds the field's planning scores by name:
    L2 and collisions at 1, 2 and 3 s by the rules of UniAD, ST-P3 and VAD, collisions and crossings of the
    drivable edge exactly. Plans that are told the point at 3 s have no figure there.

    \b
    Rows below those of planners:
    truth              what was driven
    constant-velocity  the last displacement, repeated
    straight-line      equal steps to the destination
    cubic              polynomial in time through the last two positions, the present one, the destination
    linear             least squares from past and destination, fitted to the split train
    ego-status         least squares from the past alone, in tables of plans that aren't told the point at 3 s

    With --predictions: the IoU of each class of one --definition (docs/definitions.md), over the cells that
    count by it, on the samples that the first file has, or all of --split. A file may say in `definition` (an
    attribute; npz: an array), by name or record, which labels its grids follow; another one is refused.
    """  # noqa: D301  # Click wants the character
    if pictures is not None and not runs:
        raise click.UsageError("--pictures needs a RUN.")
    if predictions or definition != PAPER:
        label_table(shards, runs, definition, predictions, (settings, split_file, cameras), form)
        return
    from ogmkit.evaluation.scope import reported_scenes

    reported_scenes(shards, settings.split, split_file)  # before torch, which takes its time
    opened = _tabled(shards, open_runs(runs))
    grids, planners = ([run for run in opened if run.output == output] for output in ("grids", "plan"))
    if grids and planners and form in ROWS:
        raise click.UsageError(f"--format {form} holds one table: give runs that predict grids, or planners.")
    if pictures is not None:
        from ogmkit.pictures.evaluation_sheet import make_folder

        make_folder(pictures, shards)
    settings = replace(settings, samples=0 if pictures is None else PICTURE_FRAMES)
    common = {"split_file": split_file, "cameras": cameras, "workers": workers}
    call = _Call(shards, settings, common, form, all_tables, pictures)
    with themed(theme):
        if grids or not planners:
            _grids(call, grids or opened)
        if grids and planners:
            click.echo()
        if planners:
            _plans(call, planners)


def open_runs(paths: tuple[Path, ...]) -> list[Run]:
    """The runs, opened once; torch is needed only if there are any."""
    if not paths:
        return []
    from .extras import require_train

    require_train()
    from ogmkit.learn.runs import checkpoint_file

    for path in paths:
        checkpoint_file(path)
    from ogmkit.learn.predict.run import open_run

    return [open_run(path) for path in paths]


def _tabled(shards: Path, runs: list[Run]) -> list[Run]:
    """Runs that have a table; others are left out with a note, unless there are only those."""
    tabled = [run for run in runs if run.output != "homography"]
    if not tabled:
        return runs  # `evaluate` says what to do instead
    for run in runs:
        if run not in tabled:
            note(
                f"{run.path}: predicts homographies, which have no table; left out. "
                f"`ogmkit predict homography {shards} --checkpoint {run.path}` shows their errors"
            )
    return tabled


def _grids(call: _Call, runs: list[Run]) -> None:
    """The first table."""
    from ogmkit.evaluation.evaluate import evaluate

    with progress(None, "frames", "evaluate") as advance:
        evaluation = evaluate(call.shards, runs, call.settings, **call.common, on_progress=advance)
    call.write(evaluation)
    if call.pictures is not None:
        from ogmkit.pictures.evaluation_sheet import draw_evaluation

        call.name(draw_evaluation(call.shards, evaluation, call.pictures))


def _plans(call: _Call, runs: list[Run]) -> None:
    """The second table."""
    from ogmkit.evaluation.planning.evaluate import evaluate_plans

    with progress(None, "sequences", "evaluate plans") as advance:
        evaluation = evaluate_plans(call.shards, runs, call.settings, **call.common, on_progress=advance)
    call.write(evaluation)
    if call.pictures is not None:
        from ogmkit.pictures.planning_sheet import draw_plans

        call.name(draw_plans(call.shards, evaluation, call.pictures))
