"""What a planning score means, as a record: two scores can be compared where their records are equal."""

from dataclasses import dataclass
from typing import Literal

Reading = Literal["at", "mean", "up-to"]
"""At the horizon's point; mean over the points up to it; whether it holds of any point up to it."""
Missing = Literal["zero-error", "left-out"]
"""What a step without truth is: an error of 0 that counts, or nothing that counts."""
Side = Literal["left", "right"]
Counted = Literal["as-none", "as-it-is"]
"""What a plan's step is where the truth itself is in contact."""


@dataclass(frozen=True)
class Obstacles:
    """The boxes that a plan can collide with.

    Attributes:
        categories: prefixes of their categories.
        min_visibility: lowest visibility level, 0 to 4; unknown passes.
        min_lidar_points: fewest LiDAR points in a box; unknown passes.
        present_only: whether those count alone that are annotated in the present frame.
    """

    categories: tuple[str, ...]
    min_visibility: int = 0
    min_lidar_points: int = 0
    present_only: bool = False


@dataclass(frozen=True)
class EgoBox:
    """The ego's outline from above.

    Attributes:
        length_m: along its heading.
        width_m: across.
        centre_ahead_m: its centre ahead of the planned point.
        turned: whether it turns with the plan; if not, it keeps the present heading.
    """

    length_m: float
    width_m: float
    centre_ahead_m: float
    turned: bool


@dataclass(frozen=True)
class Lattice:
    """200 × 200 cells of 0.5 m round an origin: rows along the way, columns across.

    Obstacles are painted with their outline, corners rounded to the lattice; the ego's cells are those whose
    index lies in its box at the origin, moved by the plan and cut to whole numbers, and kept in the array.

    Attributes:
        origin_ahead_m: of the rear axle, where plans begin all the same.
        rows_from: the end of the ego that rows are counted from.
        columns_to: the side that columns grow to.
        point_from_m: distance of a planned point's first cell from the origin: 49.75 is right but for half a
            cell.
    """

    origin_ahead_m: float
    rows_from: Literal["rear", "front"]
    columns_to: Side
    point_from_m: float


@dataclass(frozen=True)
class PlanDefinition:
    """A named set of planning scores.

    Attributes:
        name: such as `uniad`.
        version: counts changes of what the name stands for.
        reading: of the points up to a horizon.
        missing: what a step without truth is.
        obstacles: what can be collided with.
        ego: its box.
        lattice: cells that contact is looked for on; None for polygons.
        truth_in_contact: what a plan's step counts as where the truth is in contact.
        faults: what is known to be wrong with it, a clause each.
        source: the repository and commit that it is the rule of; empty for ogmkit's own.
    """

    name: str
    version: int
    reading: Reading
    missing: Missing
    obstacles: Obstacles
    ego: EgoBox
    lattice: Lattice | None
    truth_in_contact: Counted
    faults: tuple[str, ...]
    source: str = ""
