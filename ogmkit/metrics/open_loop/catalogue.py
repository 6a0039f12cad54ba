"""The named definitions of planning scores; docs/planning.md has them side by side."""

from collections.abc import Mapping
from types import MappingProxyType

from ogmkit.metrics.open_loop.definition import EgoBox, Lattice, Obstacles, PlanDefinition

_LIDAR_AHEAD_M = 0.94
"""nuScenes' LIDAR_TOP ahead of the rear axle."""
_RIGHT_FROM_M = 49.75

_VEHICLES = tuple(
    f"vehicle.{name}" for name in ("bicycle", "bus.", "car", "construction", "motorcycle", "trailer", "truck")
)
"""Of nuScenes' detection classes: no emergency vehicles."""
_PEDESTRIANS = tuple(
    f"human.pedestrian.{name}" for name in ("adult", "child", "construction_worker", "police_officer")
)
_THEIR_BOX = EgoBox(4.084, 1.85, 0.5, turned=False)

_BOX_FAULT = "the ego's box never turns"
_DROPPED_FAULT = "steps at which the truth itself collides count as steps without a collision"
_BORDER_FAULT = "beyond 50 m the ego is looked up at the border"
_ASIDE_FAULT = "the ego's cells reach from {} m on its left to {} m on its right"

UNIAD = PlanDefinition(
    "uniad",
    1,
    "at",
    "zero-error",
    Obstacles(_VEHICLES, min_lidar_points=1),
    _THEIR_BOX,
    Lattice(_LIDAR_AHEAD_M, "rear", "right", _RIGHT_FROM_M),
    "as-none",
    (
        "a missing step counts as an error of 0",
        _BOX_FAULT,
        _DROPPED_FAULT,
        "pedestrians are no obstacles",
        _ASIDE_FAULT.format("1.0", "0.5"),
        _BORDER_FAULT,
    ),
    "OpenDriveLab/UniAD@0488492",
)
STP3 = PlanDefinition(
    "stp3",
    1,
    "mean",
    "left-out",
    Obstacles(("vehicle", "human"), min_visibility=2),
    _THEIR_BOX,
    Lattice(0.0, "rear", "left", _RIGHT_FROM_M),
    "as-none",
    (
        "the figure at a horizon is the mean up to it",
        _BOX_FAULT,
        "it lies 0.9 m behind the ego: obstacles are placed from the rear axle, it as from the LiDAR",
        _DROPPED_FAULT,
        _ASIDE_FAULT.format("0.5", "1.0"),
        _BORDER_FAULT,
    ),
    "OpenDriveLab/ST-P3@f054bc4",
)
VAD = PlanDefinition(
    "vad",
    1,
    "mean",
    "left-out",
    Obstacles((*_VEHICLES, *_PEDESTRIANS), min_lidar_points=1, present_only=True),
    _THEIR_BOX,
    Lattice(_LIDAR_AHEAD_M, "front", "right", _RIGHT_FROM_M / 2),
    "as-none",
    (
        "the figure at a horizon is the mean up to it",
        "a planned point is looked up 25 m ahead and 25 m to the left of where it is",
        _BOX_FAULT,
        _DROPPED_FAULT,
        "who comes into sight later is no obstacle",
        _ASIDE_FAULT.format("1.0", "0.5"),
        _BORDER_FAULT,
    ),
    "hustvl/VAD@0a20dc7",
)
EXACT = PlanDefinition(
    "exact",
    1,
    "up-to",
    "left-out",
    Obstacles(("vehicle.", "human.")),
    # Renault Zoe: 0.657 m behind the rear axle to 3.427 m ahead of it; the width is the field's.
    EgoBox(4.084, 1.85, 1.385, turned=True),
    None,
    "as-it-is",
    ("contact between two steps is not looked for", "headings are those of the planned path"),
)

DEFINITIONS: Mapping[str, PlanDefinition] = MappingProxyType(
    {one.name: one for one in (UNIAD, STP3, VAD, EXACT)}
)
"""By their names, in the order of tables."""
