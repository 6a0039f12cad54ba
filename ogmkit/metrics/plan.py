"""What a planner says of the next seconds, as arrays that need no torch."""

from dataclasses import dataclass

from ogmkit.typing import FloatArray

STEPS = 5
"""Points that are predicted where the destination, the last point of the future, is told."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Future points 1 … T as bivariate Gaussians, in the level frame of the last image.

    T is 5, or 6 of a planner that isn't told the destination.

    Attributes:
        mean: (T, 2) float64, metres: x forward, y left. It is the prediction (design.md §3).
        sigma: (T, 2) float64, metres: standard deviations of x and y; NaN where there is no distribution.
        rho: (T,) float64, correlation of x and y; NaN as `sigma`.
    """

    mean: FloatArray
    sigma: FloatArray
    rho: FloatArray

    @property
    def told(self) -> bool:
        """Whether the planner is told the destination: it then predicts what lies before it alone."""
        return len(self.mean) == STEPS


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
