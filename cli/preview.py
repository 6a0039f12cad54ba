"""`ogmkit preview`: contact sheets of extracted frames."""

from pathlib import Path

import click

from .command import Command
from .options import cameras_option, list_option, scenes_option, shards_argument
from .paths import EXISTING_FOLDER, FOLDER
from .progress import progress


@click.command(
    cls=Command,
    examples=(
        "ogmkit preview shards --out pictures",
        "ogmkit preview shards --view footprints,stretch --scenes 'scene-00*'",
    ),
)
@shards_argument
@click.option(
    "--out",
    "pictures",
    type=FOLDER,
    help="Folder for the pictures.  [default: SHARDS with -preview after its name]",
)
@list_option(
    "--view",
    "subjects",
    choices=["targets", "footprints", "stretch", "masks"],
    metavar="VIEW,…",
    default=("targets",),
    show_default=True,
    help="What to draw, as listed above; repeat the option or separate views by commas.",
)
@click.option(
    "--masks",
    "mask_set",
    metavar="SET",
    default="surface",
    show_default=True,
    help="Set of camera-view masks to draw in all views but targets.",
)
@scenes_option
@cameras_option()
@click.option(
    "--frames",
    type=click.IntRange(1, 60),
    default=6,
    show_default=True,
    help="Frames of a sheet, evenly spread over the scene.",
)
@click.option(
    "--dataroot",
    type=EXISTING_FOLDER,
    help="Dataset with the images, where the shards only refer to them (--images reference).",
)
def command(
    shards: Path,
    pictures: Path | None,
    subjects: tuple[str, ...],
    mask_set: str,
    scenes: tuple[str, ...],
    cameras: tuple[str, ...],
    frames: int,
    dataroot: Path | None,
) -> None:
    """Draw contact sheets of extracted frames.

    One PNG for each scene and camera of SHARDS, the folder that `ogmkit extract` wrote, and for each view:

    \b
    targets     images with boxes; the plane from above: drivable area, vehicles,
                field of view, past and future
    footprints  a set of `ogmkit render-footprints` over the images; the plane; the
                set warped to the plane again, and where the two agree
    stretch     whole bodies and footprints, each warped to the plane: why
                footprints (needs the set full-body, too)
    masks       image, masks in the camera's view, masks from above

    Writes the files' names to stdout.
    """  # noqa: D301  # Click wants the character
    from ogmkit.pictures.preview import preview

    with progress(None, "sheets", "preview") as advance:
        written = preview(
            shards,
            pictures,
            subjects=subjects,
            mask_set=mask_set,
            scenes=scenes,
            cameras=cameras,
            frames=frames,
            dataroot=dataroot,
            on_progress=advance,
        )
    for path in written:
        click.echo(path)
