"""`ogmkit synthesize`."""

from pathlib import Path

import click

from .options import list_option
from .options import size as size_type
from .progress import progress
from .text import with_number

_CAMERAS = (
    "CAM_FRONT",
    "CAM_FRONT_RIGHT",
    "CAM_BACK_RIGHT",
    "CAM_BACK",
    "CAM_BACK_LEFT",
    "CAM_FRONT_LEFT",
)


@click.command()
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--num-scenes",
    "scenes",
    default=4,
    show_default=True,
    help="Number of scenes, spread over four locations.",
)
@click.option("--frames", default=20, show_default=True, help="Key frames a scene, half a second apart.")
@click.option("--seed", default=0, show_default=True, help="The same seed gives the same dataset.")
@click.option(
    "--version", default="v1.0-mini", show_default=True, metavar="NAME", help="Folder of the tables."
)
@list_option(
    "--camera",
    "--cameras",
    "cameras",
    default=_CAMERAS,
    metavar="CHANNEL,…",
    show_default="all six",
    help="Camera channel, such as CAM_FRONT; repeat the option or separate channels by commas.",
)
@click.option(
    "--image-size",
    "size",
    type=size_type,
    default="450x800",
    show_default=True,
    metavar="HEIGHTxWIDTH",
    help="Size of the images.",
)
@click.option("--lidar/--no-lidar", default=True, show_default=True, help="Make LiDAR sweeps.")
@click.option("--sweeps", is_flag=True, help="Also what the sensors record between key frames.")
@click.option(
    "--relief",
    "relief_m",
    default=0.0,
    show_default=True,
    metavar="METRES",
    help="How much the ground's height varies; 0 is a flat world.",
)
@click.option(
    "--incidents",
    is_flag=True,
    help="Vehicles stand in the ego's lanes, to be passed by swerving, and the car ahead brakes suddenly.",
)
def command(
    out: Path,
    scenes: int,
    frames: int,
    seed: int,
    version: str,
    cameras: tuple[str, ...],
    size: tuple[int, int],
    lidar: bool,
    sweeps: bool,
    relief_m: float,
    incidents: bool,
) -> None:
    """Make a nuScenes-style dataset out of nothing.

    OUT must be absent or empty. The dataset has all tables, map masks and map expansions, rendered camera
    images and LiDAR sweeps, and a splits.json.
    """
    from ogmkit.synthetic.build import SynthesisSettings, synthesize

    settings = SynthesisSettings(
        scenes=scenes,
        frames=frames,
        seed=seed,
        version=version,
        cameras=cameras,
        image_size=size,
        lidar=lidar,
        sweeps=sweeps,
        relief_m=relief_m,
        incidents=incidents,
    )
    with progress(None, "files", "synthesize") as advance:
        summary = synthesize(out, settings, on_progress=advance)
    click.echo(
        f"{out}: {with_number(len(summary.scenes), 'scene')} at {', '.join(summary.locations)}; "
        f"{with_number(summary.samples, 'key frame')}, {with_number(summary.annotations, 'box')}, "
        f"{with_number(summary.files, 'sensor file')}"
    )
