"""The settings of a training that planners alone have, as options."""

import click

from .options import size

PLANNER_OPTIONS = (
    click.option("--no-past", is_flag=True, help="Leave out the past trajectory (planners but for lstm-ed)."),
    click.option(
        "--pool",
        type=size,
        metavar="ROWSxCOLUMNS",
        default="100x55",
        show_default=True,
        help="What masks are averaged to, at most, before a planner sees them.",
    ),
    click.option("--hidden", type=int, default=128, show_default=True, help="States of the planners' LSTMs."),
    click.option(
        "--warp",
        metavar="SOURCE",
        default="network",
        show_default=True,
        help="Homographies that lead holistic to the plane.",
    ),
    click.option(
        "--perception",
        metavar="RUN",
        show_default="none: begin at random",
        help="Run of footprints that the perception of holistic and holistic-cv begins with.",
    ),
    click.option("--freeze", is_flag=True, help="Leave that perception as it is, and train the planner."),
    click.option(
        "--perception-weight",
        type=float,
        default=0.1,
        show_default=True,
        help="Of the perception's loss beside the motion's (holistic, holistic-cv).",
    ),
    click.option(
        "--checkpoint-gradients",
        is_flag=True,
        help="Less memory for more time: go through residual blocks twice (planners that see images).",
    ),
)
