"""`ogmkit preview`: contact sheets of extracted frames."""

from pathlib import Path

import click

from ogmkit.pictures.settings import PreviewSettings

from .command import Command
from .options import cameras_option, scenes_option, shards_argument, workers_option
from .paths import EXISTING_FOLDER, FOLDER
from .progress import progress
from .record_options import record_options


@click.command(
    cls=Command,
    examples=(
        "ogmkit preview shards --out pictures",
        "ogmkit preview shards --view footprints,stretch --scenes 'scene-00*' --theme light --workers 4",
    ),
)
@shards_argument
@click.option(
    "--out",
    "pictures",
    type=FOLDER,
    help="Folder for the pictures.  [default: SHARDS with -preview after its name]",
)
@record_options(PreviewSettings, "settings")
@scenes_option
@cameras_option()
@click.option(
    "--dataroot",
    type=EXISTING_FOLDER,
    help="Dataset with the images, where the shards only refer to them (--images reference).",
)
@workers_option
def command(
    shards: Path,
    pictures: Path | None,
    settings: PreviewSettings,
    scenes: tuple[str, ...],
    cameras: tuple[str, ...],
    dataroot: Path | None,
    workers: int,
) -> None:
    """Draw contact sheets of extracted frames.

    One PNG for each scene and camera of SHARDS, the folder that `ogmkit extract` wrote, and for each view:

    \b
    targets     images with boxes; the plane from above: drivable area, vehicles,
                field of view, past and future
    footprints  a set of `ogmkit render-footprints` over the images; the plane; the
                set warped to the plane again, and where the two agree
    stretch     the plane; whole bodies and footprints, each warped to the plane: why
                footprints (needs the set full-body, too)
    masks       image, masks in the camera's view, masks from above
    layers      images with boxes; map layers; classes; instances with their way to
                the next frame (needs extract --layers, --classes or --instances)
    surround    one PNG a scene: all six images round the raster of the sample
                (needs `ogmkit extract --definition paper,surround`)

    Writes the files' names to stdout.
    """  # noqa: D301  # Click wants the character
    from ogmkit.pictures.preview import preview

    with progress(None, "sheets", "preview") as advance:
        written = preview(
            shards,
            pictures,
            settings,
            scenes=scenes,
            cameras=cameras,
            dataroot=dataroot,
            workers=workers,
            on_progress=advance,
        )
    for path in written:
        click.echo(path)
