"""`ogmkit predict plan`."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ogmkit.base.news import Waiting, tell

from .command import Command
from .extras import require_train
from .options import cameras_option, scenes_option, shards_split_file_option, splits_option, workers_option
from .paths import EXISTING_FILE, FILE
from .predict_masks import (
    OF_SHARDS,
    batch_size_option,
    checkpoint_option,
    homography_checkpoint_option,
    limit_option,
    require_fitting,
    source_argument,
)
from .progress import progress
from .text import with_number

if TYPE_CHECKING:
    from collections.abc import Callable

    from ogmkit.learn.predict.choice import Choice
    from ogmkit.learn.predict.plans.objects import PlanStream

_CHOICE = ("scenes", "splits", "split_file", "cameras", "limit")
"""Options that are the fields of `Choice`."""


@click.command(
    cls=Command,
    examples=(
        "ogmkit predict plan shards --checkpoint runs/holistic --out plans.json",
        "ogmkit predict plan images --checkpoint runs/end-to-end --calibration calibration.json",
    ),
)
@source_argument
@checkpoint_option
@click.option(
    "--out",
    type=FILE,
    metavar="FILE",
    help="File for the list; an existing one is replaced.  [default: stdout]",
)
@click.option(
    "--samples",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Number of trajectories to draw from each plan, each step independently.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Random seed for --samples."
)
@click.option(
    "--calibration",
    type=EXISTING_FILE,
    metavar="FILE",
    help="Calibration, past positions and destination, where SOURCE holds six images.",
)
@scenes_option
@splits_option
@shards_split_file_option
@cameras_option()
@limit_option
@batch_size_option
@workers_option
@click.option(
    "--homography",
    metavar="SOURCE",
    show_default="the one that RUN was trained with",
    help="The shards' homographies that masks are warped by (holistic).",
)
@homography_checkpoint_option
def plan(source: Path, out: Path | None, calibration: Path | None, **values: Any) -> None:  # noqa: ANN401  # options
    """Write the ego's next positions as JSON, by a trained planner.

    From SOURCE, a folder of shards that `ogmkit extract` wrote: a list with an object a line for each
    sequence of six images whose last has a valid trajectory. With --calibration, from SOURCE, a folder of six
    images, 0.5 s apart, oldest first by their names: a list of one object. FILE is one JSON object with what
    the planner needs of positions (six [x, y] in metres, the last one 0, 0), destination ([x, y] in 3 s),
    image_size and a way to the plane. See docs/predict.md.

    An object holds destination and plan: for 0.5, 1.0 … 2.5 s (and 3 s, where the planner isn't told the
    destination) the mean (x, y), standard deviations (sigma_x, sigma_y) and correlation (rho) of a Gaussian,
    in metres, x ahead and y left of the last image's ego. With --samples there are trajectories drawn from
    these, each step independently. Nothing else is written to stdout.
    """
    require_fitting(calibration, values["homography_checkpoint"], (*OF_SHARDS, "--batch-size", "--workers"))
    require_train()
    from ogmkit.learn.predict.choice import Choice, require_predictable

    choice = Choice(**{field: values.pop(field) for field in _CHOICE})
    if calibration is None:  # before torch, which takes its time
        require_predictable(values["checkpoint"], source, choice)
    with _bar(out) as advance:
        tell(Waiting("loading torch"))
        from ogmkit.learn.predict.plans.objects import json_list, write_list

        stream = _stream(source, out, calibration, choice, advance, **values)
        if out is not None:
            write_list(out, stream.objects)
        else:
            for part in json_list(stream.objects):
                click.echo(part, nl=False)
    if out is not None:
        warped = f" warped by {stream.homography}" if stream.homography else ""
        click.echo(f"{out}: {stream.name}{warped}, {with_number(stream.count, 'plan')}")


def _stream(
    source: Path,
    out: Path | None,
    calibration: Path | None,
    choice: Choice,
    advance: Callable[[int, int], None] | None,
    checkpoint: Path,
    samples: int,
    seed: int,
    batch_size: int,
    workers: int,
    homography: str | None,
    homography_checkpoint: Path | None,
) -> PlanStream:
    from ogmkit.base.atomic import require_outside
    from ogmkit.learn.predict.plans.folder import plan_of_images
    from ogmkit.learn.predict.plans.objects import PlanJob
    from ogmkit.learn.predict.plans.shards import plans_of_shards

    job = PlanJob(checkpoint, samples, seed, batch_size, workers)
    if calibration is not None:
        return plan_of_images(job, source, calibration, homography_checkpoint=homography_checkpoint)
    if out is not None:
        require_outside(out, source)
    return plans_of_shards(job, source, homography=homography, choice=choice, on_progress=advance)


def _bar(out: Path | None) -> AbstractContextManager[Callable[[int, int], None] | None]:
    """A progress bar, but where it would run into the list on the terminal."""
    if out is None and sys.stdout.isatty():
        return nullcontext()
    return progress(None, "plans", "predict plan")
