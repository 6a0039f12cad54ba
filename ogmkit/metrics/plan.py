"""What a planner says of the next seconds, as arrays that need no torch."""

from dataclasses import dataclass

from ogmkit.typing import FloatArray

STEPS = 5
"""Points that are predicted: all of the future but the destination."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Future points 1 … 5 as bivariate Gaussians, in the level frame of the last image.

    Attributes:
        mean: (5, 2) float64, metres: x forward, y left. It is the prediction (design.md §3).
        sigma: (5, 2) float64, metres: standard deviations of x and y; NaN where there is no distribution.
        rho: (5,) float64, correlation of x and y; NaN as `sigma`.
    """

    mean: FloatArray
    sigma: FloatArray
    rho: FloatArray


@dataclass(frozen=True, eq=False)
class PlannedFrame:
    """The plan of one frame.

    Attributes:
        scene: the scene's name.
        camera: channel.
        frame: place of the sequence's last frame among the camera's frames in the scene, from 0.
        plan: from there on.
    """

    scene: str
    camera: str
    frame: int
    plan: Plan
