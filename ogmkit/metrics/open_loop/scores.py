"""What a definition measures of a sequence's plans, point by point."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.metrics.open_loop.cells import collisions
from ogmkit.metrics.open_loop.contact import contacts, edge_crossings
from ogmkit.metrics.open_loop.definition import PlanDefinition
from ogmkit.metrics.open_loop.horizons import l2_m
from ogmkit.typing import FloatArray, UInt8Array

L2, COLLISION, POINT_COLLISION, EDGE_CROSSING = "l2", "collision", "point_collision", "edge_crossing"
"""Distance to the truth; whether the box hits an obstacle, whether the point does; leaves drivable area."""


def metrics_of(definition: PlanDefinition) -> tuple[str, ...]:
    """What a definition measures: on a lattice distances and collisions, else contacts and edges."""
    return (COLLISION, EDGE_CROSSING) if definition.lattice is None else (L2, COLLISION, POINT_COLLISION)


def point_values(
    definition: PlanDefinition,
    points: FloatArray,
    truth: FloatArray,
    faces: Sequence[FloatArray | None],
    drivable: UInt8Array | None,
    grid: GridSpec,
) -> Mapping[str, FloatArray]:
    """Measure several plans of one sequence.

    Args:
        definition: whose rules.
        points: (R, 6, 2) positions of R plans, metres, level frame of the present; NaN where there is none.
        truth: (6, 2) positions that were driven.
        faces: 6 arrays of (M, 4, 2) corners of the obstacles' ground faces at each step, metres, in the same
            frame; None where they aren't known.
        drivable: (rows, columns) uint8 0/1, of the present; None where it isn't known.
        grid: its grid.

    Returns:
        Name, as of `metrics_of`, → (R, 6) metres, or 0 and 1; NaN where not defined.
    """
    # The truth is a plan as well: its own contacts decide which steps count.
    values = dict(_contacts(definition, np.concatenate([truth[None], points]), faces))
    if definition.truth_in_contact == "as-none":
        driven = values[COLLISION][:1]
        values = {name: np.where((driven == 1) & (one == 1), 0.0, one) for name, one in values.items()}
    values = {name: one[1:] for name, one in values.items()}
    if definition.lattice is not None:
        return {L2: l2_m(points, truth, definition.missing), **values}
    if drivable is None:
        return {**values, EDGE_CROSSING: np.full(points.shape[:-1], np.nan)}
    return {**values, EDGE_CROSSING: edge_crossings(points, drivable, grid, definition.ego)}


def _contacts(
    definition: PlanDefinition, points: FloatArray, faces: Sequence[FloatArray | None]
) -> Iterator[tuple[str, FloatArray]]:
    if definition.lattice is None:
        yield COLLISION, contacts(points, faces, definition.ego)
        return
    box, point = collisions(points, faces, definition.ego, definition.lattice)
    yield COLLISION, box
    yield POINT_COLLISION, point
