"""`ogmkit preview`: contact sheets of extracted frames."""

from pathlib import Path

import click

from .options import cameras_option, scenes_option, shards_argument
from .progress import progress


@click.command()
@shards_argument
@click.option(
    "--out",
    "pictures",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the pictures.  [default: OUT with -preview after its name]",
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
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Dataset with the images, where the shards only refer to them (--images reference).",
)
def command(
    out: Path,
    pictures: Path | None,
    scenes: tuple[str, ...],
    cameras: tuple[str, ...],
    frames: int,
    dataroot: Path | None,
) -> None:
    """Draw contact sheets of extracted frames.

    For each scene and camera of OUT, the folder that `ogmkit extract` wrote, one PNG: camera images with
    projected boxes beside the plane from above, with drivable area, vehicles, field of view, past and future.
    Writes the files' names to stdout.
    """
    from ogmkit.pictures.preview import preview

    with progress(None, "sheets", "preview") as advance:
        written = preview(
            out,
            pictures,
            scenes=scenes,
            cameras=cameras,
            frames=frames,
            dataroot=dataroot,
            on_progress=advance,
        )
    for path in written:
        click.echo(path)
