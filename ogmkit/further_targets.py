"""A frame's rasters beside the paper's: map layers, classes of boxes, instances, what follows."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ogmkit.base.steps import STEPS
from ogmkit.frames import Boxes, FrameRecord
from ogmkit.raster.instances import centre_offset, instance_raster, rigid_flow
from ogmkit.raster.layers import LayerMap, layer_masks
from ogmkit.raster.vehicles import observed, select, vehicle_mask
from ogmkit.target_settings import TargetSettings
from ogmkit.trajectories import trajectory
from ogmkit.typing import BoolArray, Float32Array, FloatArray, UInt8Array, UInt16Array

Rasters = Mapping[str, UInt8Array | UInt16Array | Float32Array | BoolArray]
"""Name of a shard's dataset, below the camera's group → the frame's row."""


@dataclass(frozen=True, eq=False)
class Around:
    """What a frame's further rasters need that is not the frame's own.

    Attributes:
        layers: of its map; those that the settings name, or none to leave them out.
        numbers: instance token → 1 to 65535; None numbers the frame's own vehicles in their order.
        following: boxes of the next key frames, None for one that is not there.
    """

    layers: LayerMap = field(default_factory=dict)
    numbers: Mapping[str, int] | None = None
    following: Sequence[Boxes | None] = ()


NOTHING = Around()


def further_targets(
    level_from_global: FloatArray, boxes: Boxes, settings: TargetSettings, around: Around
) -> Rasters:
    """Draw what the settings ask for beside the paper's targets.

    Args:
        level_from_global: (4, 4) of the frame.
        boxes: all of the frame.
        settings: what to draw.
        around: what lies around the frame.

    Returns:
        `layers/<layer>` and `classes/<class>`: (rows, columns) uint8 0/1. `instances/id`: the same, uint16.
        `instances/offset` and `instances/flow`: (2, rows, columns) float32 metres. `future/vehicles`: (n,
        rows, columns) uint8 0/1; `future/valid`: (n,) bool. As far as they are asked for.
    """
    layers = layer_masks(settings.grid, level_from_global, around.layers)
    classes = _classes(level_from_global, boxes, settings)
    instances = _instances(level_from_global, boxes, settings, around) if settings.instances else {}
    future = _future(level_from_global, settings, around.following) if settings.future else {}
    return {f"layers/{name}": mask for name, mask in layers.items()} | classes | instances | future


def instance_numbers(boxes: Iterable[Boxes], settings: TargetSettings) -> dict[str, int]:
    """Number the vehicles among the boxes of a camera's frames from 1, in the order in which they appear."""
    shown = (select(one, *settings.labels).instance_token for one in boxes)
    return {token: 1 + i for i, token in enumerate(dict.fromkeys(token for one in shown for token in one))}


def following_boxes(
    frames: Sequence[FrameRecord], settings: TargetSettings
) -> list[tuple[Boxes | None, ...]]:
    """Of each of a camera's frames, the boxes of the next key frames, as many as its rasters need.

    They are a step apart, as a trajectory's are, and end where that does; a frame that is left out has none.
    """
    by_time = {frame.timestamp_us: frame.boxes for frame in frames}
    steps = range(settings.following)
    found = []
    for frame in frames if steps else ():
        times_us = frame.neighbour_timestamps_us[STEPS + 1 :]
        valid = trajectory(frame, settings.gap_s, step_s=settings.step_s).future_valid
        found.append(tuple(by_time.get(int(times_us[step])) if valid[step] else None for step in steps))
    return found or [()] * len(frames)


def _classes(level_from_global: FloatArray, boxes: Boxes, settings: TargetSettings) -> dict[str, UInt8Array]:
    seen = observed(boxes.visibility, boxes.num_lidar_pts, settings.min_visibility, settings.min_lidar_points)
    drawn = {}
    for one in settings.box_classes:
        named = np.array([one.shows(category) for category in boxes.category], dtype=np.bool_)
        drawn[f"classes/{one.name}"] = vehicle_mask(
            settings.grid, level_from_global, boxes.selected(named & seen)
        )
    return drawn


def _instances(
    level_from_global: FloatArray, boxes: Boxes, settings: TargetSettings, around: Around
) -> dict[str, UInt16Array | Float32Array]:
    shown = select(boxes, *settings.labels)
    known = around.numbers
    numbers = np.array(
        range(1, len(shown) + 1) if known is None else [known[token] for token in shown.instance_token],
        dtype=np.int64,
    )
    drawn = instance_raster(settings.grid, level_from_global, shown, numbers)
    if not settings.flow:
        return {"instances/id": drawn}
    following = next(iter(around.following), None) or boxes.selected(np.zeros(len(boxes), dtype=np.bool_))
    frame = settings.grid, level_from_global, shown
    return {
        "instances/id": drawn,
        "instances/offset": centre_offset(*frame, numbers, drawn),
        "instances/flow": rigid_flow(*frame, following, numbers, drawn),
    }


def _future(
    level_from_global: FloatArray, settings: TargetSettings, following: Sequence[Boxes | None]
) -> dict[str, UInt8Array | BoolArray]:
    """Vehicles of the next frames on this one's grid; 0 where a frame is not there."""
    vehicles = np.zeros((settings.future, *settings.grid.shape), np.uint8)
    valid = np.zeros(settings.future, np.bool_)
    for step, boxes in enumerate(following[: settings.future]):
        if boxes is not None:
            vehicles[step] = vehicle_mask(settings.grid, level_from_global, select(boxes, *settings.labels))
            valid[step] = True
    return {"future/vehicles": vehicles, "future/valid": valid}
