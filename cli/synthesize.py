"""`ogmkit synthesize`."""

from pathlib import Path

import click

from ogmkit.synthetic.settings import SynthesisSettings

from .command import Command
from .paths import ANY
from .progress import progress
from .record_options import record_options
from .text import with_number


@click.command(
    cls=Command,
    examples=(
        "ogmkit synthesize world",
        "ogmkit synthesize world --num-scenes 10 --frames 40 --image-size 225x400",
    ),
)
@click.argument("out", type=ANY)
@record_options(SynthesisSettings, "settings")
def command(out: Path, settings: SynthesisSettings) -> None:
    """Generate a synthetic nuScenes-style dataset.

    OUT must be absent or empty. The dataset has all tables, map masks and map expansions, rendered camera
    images and LiDAR sweeps, and a splits.json.
    """
    from ogmkit.synthetic.build import synthesize

    with progress(None, "files", "synthesize") as advance:
        summary = synthesize(out, settings, on_progress=advance)
    click.echo(
        f"{out}: {with_number(len(summary.scenes), 'scene')} at {', '.join(summary.locations)}; "
        f"{with_number(summary.samples, 'key frame')}, {with_number(summary.annotations, 'box')}, "
        f"{with_number(summary.files, 'sensor file')}"
    )
