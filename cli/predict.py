"""`ogmkit predict`."""

from __future__ import annotations

from pathlib import Path

import click

from ogmkit.base.news import Waiting, tell

from .command import Command
from .extras import require_train
from .groups import SuggestingGroup
from .homography_table import summary_lines
from .options import cameras_option, scheduler_option, shards_argument, workers_option
from .predict_masks import SYSTEMS, batch_size_option, checkpoint_option, system_command
from .predict_plan import plan
from .progress import progress


@click.group(
    cls=SuggestingGroup,
    examples=(
        "ogmkit predict homography shards --checkpoint runs/homography",
        "ogmkit predict footprints shards --checkpoint runs/footprints --out masks",
    ),
)
def command() -> None:
    """Predict with a trained network."""


@command.command(
    cls=Command,
    examples=(
        "ogmkit predict homography shards --checkpoint runs/homography",
        "ogmkit predict homography shards --checkpoint runs/other --name network-other --workers 2",
    ),
)
@shards_argument
@checkpoint_option
@click.option(
    "--name",
    metavar="NAME",
    default="network",
    show_default=True,
    help="Name of the homographies: network or network-….",
)
@cameras_option()
@batch_size_option
@workers_option
@scheduler_option
@click.option("--overwrite", is_flag=True, help="Replace existing predictions; another RUN is allowed.")
def homography(
    shards: Path,
    checkpoint: Path,
    name: str,
    cameras: tuple[str, ...],
    batch_size: int,
    workers: int,
    scheduler: str,
    overwrite: bool,
) -> None:
    """Add a network's homographies to shards.

    Adds a group homography/<name> to each camera of SHARDS, a folder that `ogmkit extract` wrote, and shows
    their errors as `ogmkit homography-fit` does; the network has seen no box of any frame. A frame where its
    answer is not a homography is marked invalid, with the reason. To resume after an interruption, run the
    same command again.
    """
    require_train()
    from ogmkit.learn.predict.choice import Choice, require_predictable

    require_predictable(checkpoint, shards, Choice(cameras=cameras))  # before torch, which takes its time
    with progress(None, "shards", "predict homography") as advance:
        tell(Waiting("loading torch"))
        from ogmkit.base.execution import Execution
        from ogmkit.learn.predict.homographies import predict_homographies

        summary = predict_homographies(
            shards,
            checkpoint,
            name=name,
            cameras=cameras,
            batch_size=batch_size,
            execution=Execution(workers, scheduler, overwrite=overwrite, on_progress=advance),
        )
    for line in summary_lines(summary):
        click.echo(line)


for _system in SYSTEMS:
    command.add_command(system_command(_system))
command.add_command(plan)
