"""`ogmkit export`."""

from pathlib import Path

import click

from .command import Command
from .extras import require_onnx, require_train
from .paths import ANY, EXISTING


@click.command(
    cls=Command,
    examples=(
        "ogmkit export runs/footprints --out model.onnx",
        "ogmkit export runs/homography/last.ckpt --out model.onnx --opset 18",
    ),
)
@click.argument("run", type=EXISTING)
@click.option(
    "--out",
    type=ANY,
    metavar="FILE",
    required=True,
    help="The model's file, such as model.onnx; an existing one is replaced.",
)
@click.option(
    "--opset", type=int, default=17, show_default=True, help="Version of ONNX's operators, 16 to 20."
)
def command(run: Path, out: Path, opset: int) -> None:
    """Export a trained network to ONNX.

    RUN is a folder that `ogmkit train` wrote, or a checkpoint, of footprints or homography. The model takes
    images (B, 3, height, width), RGB, 0 to 1, of the size that it was trained on, and gives probabilities of
    drivable area and vehicles in camera view, or homographies from the image's pixels to the grid's cells.
    Its metadata holds settings, grid and cameras. Its answers are compared with torch's before it is written.
    """
    require_train()
    require_onnx()
    from ogmkit.learn.export.onnx import export

    summary = export(run, out, opset=opset)
    height, width = summary.image_size
    cameras = " and camera" if "camera" in summary.inputs else ""
    click.echo(
        f"{out}: {summary.system}, image {height} × {width}{cameras} → {summary.output}, "
        f"{summary.bytes / 1e6:.1f} MB, differs from torch by {summary.difference:.1e} at most"
    )
