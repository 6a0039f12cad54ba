"""`ogmkit predict footprints|ved|oft|bev-lidar`: one command for each system, the same but for its inputs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ogmkit.base.news import Waiting, tell

from .command import Command
from .extras import require_train
from .options import (
    cameras_option,
    scenes_option,
    scheduler_option,
    shards_split_file_option,
    splits_option,
    workers_option_of,
)
from .paths import EXISTING, EXISTING_FILE, EXISTING_FOLDER, FOLDER
from .progress import progress
from .text import with_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ogmkit.learn.predict.files import Format
    from ogmkit.learn.predict.shards import PredictionSummary

SYSTEMS = {
    "footprints": "Write masks in camera view, and warped to the plane.",
    "ved": "Write masks on the plane by a variational encoder–decoder.",
    "oft": "Write masks on the plane by the Orthographic Feature Transform.",
    "bev-lidar": "Write masks on the plane by LiDAR points from above.",
}
"""Systems whose predictions are masks, with the first sentence of each command's help."""

checkpoint_option = click.option(
    "--checkpoint",
    type=EXISTING,
    metavar="RUN",
    required=True,
    help="Folder that `ogmkit train` wrote, whose best checkpoint is used; or a checkpoint.",
)
source_argument = click.argument("source", type=EXISTING_FOLDER)
limit_option = click.option(
    "--limit-frames",
    "limit",
    type=click.IntRange(min=1),
    show_default="all",
    help="Maximum number of frames, evenly spread.",
)
homography_checkpoint_option = click.option(
    "--homography-checkpoint",
    type=EXISTING,
    metavar="RUN",
    help="RUN of homography that gives the way to the plane, with --calibration.",
)
batch_size_option = click.option(
    "--batch-size",
    type=click.IntRange(min=1),
    default=8,
    show_default=True,
    help="Number of frames in a batch.",
)

OF_SHARDS = (
    "--homography",
    "--scenes",
    "--split",
    "--split-file",
    "--camera",
    "--limit-frames",
    "--scheduler",
)
"""Options that go with shards, not with images and a calibration."""
_HELP = """{first}

From SOURCE, a folder of shards that `ogmkit extract` wrote: FOLDER gets <scene>.h5, with a group for each
camera and a row for each frame; or <scene>_<camera>_<frame>_<view>_<target>.png, where a view is image or bev
and a target drivable or vehicles.

With --calibration, from SOURCE, a folder of {inputs}: FOLDER gets predictions.h5 or
<name>_<view>_<target>.png. FILE is one JSON object, or one for each input by its name, with {keys}. See
docs/predict.md.
"""
_EXAMPLES = (
    "ogmkit predict {system} shards --checkpoint runs/{system} --out masks",
    "ogmkit predict {system} files --checkpoint runs/{system} --out masks --calibration calibration.json",
)
_KEYS = {
    "footprints": "image_size and either bev_from_image (3 × 3, pixels to cells), intrinsics (3 × 3) and "
    "level_from_camera (4 × 4), or --homography-checkpoint",
    "ved": "image_size ([height, width])",
    "oft": "image_size, intrinsics (3 × 3) and level_from_camera (4 × 4)",
    "bev-lidar": "level_from_lidar (4 × 4)",
}

_OPTIONS = (
    source_argument,
    checkpoint_option,
    click.option(
        "--out",
        "folder",
        type=FOLDER,
        metavar="FOLDER",
        required=True,
        help="Folder for the files; existing files of the same names are replaced.",
    ),
    click.option(
        "--format",
        "form",
        type=click.Choice(["hdf5", "png"]),
        default="hdf5",
        show_default=True,
        help="Probabilities as float16; or as grey pictures, 255 for a probability of 1.",
    ),
    click.option(
        "--calibration",
        type=EXISTING_FILE,
        metavar="FILE",
        help="Calibration of the camera or LiDAR, where SOURCE holds no shards.",
    ),
    scenes_option,
    splits_option,
    shards_split_file_option,
    cameras_option(),
    limit_option,
    batch_size_option,
    workers_option_of(
        "Number of worker processes that load data for the network; 0 or 1 loads it in this process. With "
        "--scheduler local, each worker loads the network and predicts one scene at a time."
    ),
    scheduler_option,
)
_FOOTPRINT_OPTIONS = (
    click.option(
        "--homography",
        metavar="SOURCE",
        show_default="network if there, else surface",
        help="The shards' homographies that masks are warped by.",
    ),
    homography_checkpoint_option,
)


def system_command(system: str) -> click.Command:
    """The command of one system."""

    def run(**values: Any) -> None:  # noqa: ANN401  # the parameters of `_run`
        _run(system, **values)

    more = _FOOTPRINT_OPTIONS if system == "footprints" else ()
    for option in reversed((*_OPTIONS, *more)):
        run = option(run)
    inputs = "*.pcd.bin" if system == "bev-lidar" else "*.jpg and *.png"
    text = _HELP.format(first=SYSTEMS[system], inputs=inputs, keys=_KEYS[system])
    shown = tuple(example.format(system=system) for example in _EXAMPLES)
    return click.command(system, cls=Command, help=text, examples=shown)(run)


def _run(
    system: str,
    source: Path,
    checkpoint: Path,
    folder: Path,
    form: Format,
    calibration: Path | None,
    batch_size: int,
    workers: int,
    scheduler: str,
    homography: str | None = None,
    homography_checkpoint: Path | None = None,
    **chosen: Any,  # noqa: ANN401  # the fields of `Choice`
) -> None:
    require_fitting(calibration, homography_checkpoint, OF_SHARDS)
    require_train()
    from ogmkit.learn.predict.choice import Choice, require_predictable

    choice = Choice(**chosen)
    if calibration is None:  # before torch, which takes its time
        require_predictable(checkpoint, source, choice)
    with progress(None, "frames", f"predict {system}") as advance:
        tell(Waiting("loading torch"))
        from ogmkit.learn.predict.images import predict_images
        from ogmkit.learn.predict.shards import PredictionJob, predict_shards

        job = PredictionJob(system, checkpoint, folder, form, batch_size, workers)
        if calibration is None:
            summary = predict_shards(
                job,
                source,
                homography=homography,
                choice=choice,
                scheduler=scheduler,
                on_progress=advance,
            )
        else:
            summary = predict_images(
                job, source, calibration, homography_checkpoint=homography_checkpoint, on_progress=advance
            )
    click.echo(_line(folder, summary))


def require_fitting(
    calibration: Path | None, homography_checkpoint: Path | None, of_shards: Sequence[str]
) -> None:
    """Refuse options that go with the other kind of source.

    Args:
        calibration: file that comes with images; None where shards are predicted.
        homography_checkpoint: goes with images.
        of_shards: options that go with shards.
    """
    context = click.get_current_context()
    if calibration is None:
        if homography_checkpoint is not None:
            raise click.UsageError(
                "--homography-checkpoint goes with --calibration; for shards, run ogmkit predict homography."
            )
        return
    for option in context.command.params:
        given = context.get_parameter_source(str(option.name)) is not ParameterSource.DEFAULT
        if given and option.opts[0] in of_shards:
            raise click.UsageError(f"{option.opts[0]} goes with shards, not with --calibration.")


def _line(folder: Path, summary: PredictionSummary) -> str:
    warped = f" warped by {summary.homography}" if summary.homography else ""
    ms = 1e3 * summary.seconds / summary.frames
    return (
        f"{folder}: {summary.system}{warped}, {with_number(summary.frames, 'frame')} in "
        f"{with_number(summary.files, 'file')}, {summary.seconds:.1f} s ({ms:.0f} ms a frame)"
    )
