"""What a definition measures of a sequence's plans, point by point."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.metrics.open_loop.cells import collisions
from ogmkit.metrics.open_loop.contact import contacts, edge_crossings
from ogmkit.metrics.open_loop.definition import Lattice, PlanDefinition
from ogmkit.metrics.open_loop.horizons import l2_m
from ogmkit.typing import FloatArray, UInt8Array

L2, COLLISION, POINT_COLLISION, EDGE_CROSSING = "l2", "collision", "point_collision", "edge_crossing"
"""Distance to the truth; whether the box hits an obstacle, whether the point does; leaves drivable area."""


def metrics_of(definition: PlanDefinition) -> tuple[str, ...]:
    """What a definition measures: on a lattice distances and collisions, else contacts and edges."""
    return (COLLISION, EDGE_CROSSING) if definition.lattice is None else (L2, COLLISION, POINT_COLLISION)


@dataclass(frozen=True, eq=False)
class Surrounding:
    """What is around a sequence's future, in the level frame of its present.

    Attributes:
        truth: (6, 2) positions that were driven, metres.
        faces: 6 arrays of (M, 4, 2) corners of the obstacles' ground faces at each step, metres; None where
            they aren't known.
        drivable: (rows, columns) uint8 0/1, of the present; None where it isn't known.
        grid: its grid.
    """

    truth: FloatArray
    faces: Sequence[FloatArray | None]
    drivable: UInt8Array | None
    grid: GridSpec


def point_values(
    definition: PlanDefinition, points: FloatArray, around: Surrounding, known: FloatArray | None = None
) -> Mapping[str, FloatArray]:
    """Measure several plans of one sequence.

    Args:
        definition: whose rules.
        points: (R, 6, 2) positions of R plans, metres, level frame of the present; NaN where there is none.
        around: the present's future.
        known: (R, 6) headings, as of `body.placed`.

    Returns:
        Name, as of `metrics_of`, → (R, 6) metres, or 0 and 1; NaN where not defined.
    """
    box = definition.ego
    if definition.lattice is not None:
        hits = _hits(definition, definition.lattice, points, around)
        return {L2: l2_m(points, around.truth, definition.missing), **hits}
    crossed = np.full(points.shape[:-1], np.nan)
    if around.drivable is not None:
        crossed = edge_crossings(points, around.drivable, around.grid, box, known)
    return {COLLISION: contacts(points, around.faces, box, known), EDGE_CROSSING: crossed}


def _hits(
    definition: PlanDefinition, lattice: Lattice, points: FloatArray, around: Surrounding
) -> Mapping[str, FloatArray]:
    """Collisions of box and point; the truth is looked at as well, as a plan before the others."""
    plans = np.concatenate([around.truth[None], points])
    found = collisions(plans, around.faces, definition.ego, lattice)
    if definition.truth_in_contact == "as-none":
        found = np.where((found[:1, :1] == 1) & (found == 1), 0.0, found)
    return dict(zip((COLLISION, POINT_COLLISION), found[:, 1:], strict=True))
