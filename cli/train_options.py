"""The settings of a training as options; each has the name of the setting."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from .options import cameras_option, shards_split_file_option, size
from .planner_options import PLANNER_OPTIONS

Function = TypeVar("Function", bound=Callable[..., Any])


def ratio(value: str | tuple[int, int]) -> tuple[int, int]:
    """An option's type: A/B, such as 77/9."""
    if isinstance(value, tuple | list):
        first, second = value
        return first, second
    left, _, right = value.partition("/")
    if not (left.isdecimal() and right.isdecimal() and int(left) and int(right)):
        raise click.BadParameter(f"{value!r} is not A/B, such as 77/9")
    return int(left), int(right)


_OPTIONS = (
    cameras_option(),
    click.option(
        "--train-split", metavar="NAME", default="train", show_default=True, help="Split to learn from."
    ),
    click.option(
        "--val-split",
        metavar="NAME",
        default="val",
        show_default=True,
        help="Split that the best checkpoint is chosen by.",
    ),
    shards_split_file_option,
    click.option(
        "--split-ratio",
        type=ratio,
        metavar="A/B",
        help="Divide the scenes at random, such as 77/9; RUN/splits.json is then a --split-file.",
    ),
    click.option(
        "--image-size",
        type=size,
        metavar="HEIGHTxWIDTH",
        default="448x800",
        show_default=True,
        help="Size that images are resized to.  No effect on bev-lidar, lstm-ed and mid-to-end.",
    ),
    click.option(
        "--encoder",
        metavar="NAME",
        default="",
        show_default="resnet101; resnet18 for homography and oft, vgg16_bn for ved",
        help="Encoder by segmentation-models-pytorch's name.",
    ),
    click.option(
        "--encoder-weights",
        metavar="FILE|NAME",
        show_default="none: begin at random",
        help="File of weights; or a name such as imagenet, which is downloaded.",
    ),
    click.option(
        "--masks",
        metavar="SET",
        show_default="network if there, else surface",
        help="Camera-view masks that footprints and the holistic planners learn; full-body is the control.",
    ),
    click.option(
        "--target",
        metavar="SOURCE",
        default="surface",
        show_default=True,
        help="Homographies that homography learns, and that --bev-loss warps by.",
    ),
    click.option(
        "--head",
        type=click.Choice(["entries", "four-point"]),
        default="entries",
        show_default=True,
        help="What homography regresses: matrix entries, or where four points of the ground appear.",
    ),
    click.option(
        "--bev-cell",
        "bev_cell_m",
        type=float,
        metavar="METRES",
        show_default="the shards' cells; 1 for oft",
        help="Side of the cells that ved, oft and bev-lidar work on.",
    ),
    click.option(
        "--bev-loss", is_flag=True, help="Also a loss in BEV, which the paper found to diverge (footprints)."
    ),
    click.option(
        "--kl-weight",
        type=float,
        default=1.0,
        show_default=True,
        help="Weight of the latent's KL term (ved).",
    ),
    click.option("--channels", type=int, default=256, show_default=True, help="Channels of features (oft)."),
    click.option(
        "--blocks",
        type=int,
        default=8,
        show_default=True,
        help="Residual blocks of the top-down network (oft).",
    ),
    *PLANNER_OPTIONS,
    click.option(
        "--epochs",
        type=int,
        show_default="100; 200 for planners",
        help="Passes over the frames, or sequences.",
    ),
    click.option(
        "--batch-size",
        type=int,
        show_default="8; 10 for planners",
        help="Frames, or sequences, at a time.",
    ),
    click.option(
        "--accumulate", type=int, default=1, show_default=True, help="Batches whose gradients make one step."
    ),
    click.option(
        "--optimizer",
        type=click.Choice(["sgd", "adamw"]),
        default="sgd",
        show_default=True,
        help="How weights are moved.",
    ),
    click.option("--lr", type=float, show_default="1e-3; 1e-7 for oft", help="Learning rate."),
    click.option(
        "--schedule",
        type=click.Choice(["constant", "cosine"]),
        default="constant",
        show_default=True,
        help="Learning rate over all steps: constant, or down to 0 along a cosine.",
    ),
    click.option("--momentum", type=float, default=0.9, show_default=True, help="Momentum of sgd."),
    click.option("--weight-decay", type=float, default=0.0, show_default=True, help="Decay of all weights."),
    click.option(
        "--clip-norm",
        type=float,
        show_default="0; 1 for planners",
        help="Norm that a step's gradients are scaled down to if theirs is larger; 0 leaves them.",
    ),
    click.option(
        "--colour",
        type=float,
        default=0.0,
        show_default=True,
        help="Strength of random brightness, contrast and saturation, 0 to 1.  No effect without images.",
    ),
    click.option(
        "--flip", type=float, default=0.0, show_default=True, help="Probability of a horizontal flip."
    ),
    click.option(
        "--crop",
        type=float,
        default=0.0,
        show_default=True,
        help="Share of an image's sides cut off at random, at most.  No effect without images.",
    ),
    click.option("--seed", type=int, default=0, show_default=True, help="Everything random comes from it."),
    click.option("--max-steps", type=int, show_default="no bound", help="Steps of the optimiser at most."),
    click.option(
        "--limit-frames",
        type=int,
        show_default="all",
        help="Frames, or sequences, of each split, evenly spread.",
    ),
    click.option(
        "--workers",
        type=int,
        default=2,
        show_default=True,
        help="Number of worker processes that read samples; 0 reads in this process.",
    ),
    click.option(
        "--devices", type=int, show_default="1", help="GPUs to train on; processes where there is no GPU."
    ),
    click.option(
        "--precision",
        type=click.Choice(["32-true", "16-mixed", "bf16-mixed"]),
        default="32-true",
        show_default=True,
        help="Of the arithmetic.",
    ),
    click.option(
        "--checkpoint-every",
        type=int,
        default=500,
        show_default=True,
        help="Steps between checkpoints within an epoch.",
    ),
)


def setting_options(function: Function) -> Function:
    """All of them, handed to the command by the settings' names."""
    for option in reversed(_OPTIONS):
        function = option(function)
    return function
