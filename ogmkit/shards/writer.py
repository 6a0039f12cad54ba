"""Writing a shard: one scene, frame by frame, with no more than a frame's rasters in memory."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ogmkit import __version__
from ogmkit.errors import TableError
from ogmkit.frames import FrameRecord, SceneRecord
from ogmkit.nuscenes.maps import MapMask, MaskStore
from ogmkit.nuscenes.paths import resolve
from ogmkit.shards import schema
from ogmkit.shards.atomic import replacing
from ogmkit.shards.columns import column
from ogmkit.shards.schema import Field
from ogmkit.shards.settings import Compression, ExtractSettings
from ogmkit.shards.sink import ShardFile, create
from ogmkit.targets import FrameTargets, TargetSettings, build_targets
from ogmkit.trajectories import Trajectory

_FILTERS: dict[Compression, dict[str, Any]] = {
    # Level 1: masks shrink 45-fold at the cost of a copy; level 9 halves that for twelve times the time.
    "gzip": {"compression": "gzip", "compression_opts": 1},
    "lzf": {"compression": "lzf"},
    "none": {},
}
_POINTS_PER_CHUNK = 8192


@dataclass
class _Tally:
    """What is known of a camera's frames once they are written."""

    trajectories: list[Trajectory]
    points: list[int]
    drivable_cells: int = 0
    vehicle_cells: int = 0


def write_shard(
    path: Path,
    scene: SceneRecord,
    settings: TargetSettings,
    masks: MaskStore,
    *,
    dataset_version: str,
    compression: Compression = "gzip",
) -> None:
    """Write one scene's shard; it appears under its name only when it is whole.

    Args:
        path: the shard's file, in an existing folder.
        scene: its frames; the cameras there are the shard's.
        settings: what targets to make.
        masks: the store of decoded map masks.
        dataset_version: the source's tables, such as `v1.0-mini`.
        compression: of rasters and LiDAR points.

    Raises:
        DataFileError: a file of the dataset is absent or damaged.
        TableError: a camera has no frames, or a file name leaves the dataset's root.
        OutputError: the disk is full or refuses otherwise.
    """
    stored = ExtractSettings(settings, tuple(scene.cameras), compression)
    with replacing(path) as part, create(part) as file:
        with file.writing() as h5:
            h5.attrs.update(_file_attributes(scene, stored, dataset_version))
        for camera, frames in sorted(scene.cameras.items()):
            if not frames:
                raise TableError(f"scene {scene.name}: has no key frames of {camera}; choose another camera")
            _write_camera(file, camera, frames, stored, masks)


def _file_attributes(scene: SceneRecord, settings: ExtractSettings, dataset_version: str) -> dict[str, Any]:
    grid = settings.targets.grid
    values: dict[str, Any] = {
        "format": schema.FORMAT,
        "format_version": schema.FORMAT_VERSION,
        "package_version": __version__,
        "dataset_version": dataset_version,
        "scene": scene.name,
        "location": scene.location,
        "settings": json.dumps(settings.to_dict(), sort_keys=True),
        "grid_m_per_cell": grid.m_per_cell,
        "grid_rows": grid.rows,
        "grid_columns": grid.columns,
        "grid_ego_row": grid.ego_row,
        "grid_ego_column": grid.ego_column,
    }
    return {attribute.name: attribute.kind(values[attribute.name]) for attribute in schema.FILE_ATTRIBUTES}


def _write_camera(
    file: ShardFile,
    camera: str,
    frames: Sequence[FrameRecord],
    settings: ExtractSettings,
    masks: MaskStore,
) -> None:
    targets, grid = settings.targets, settings.targets.grid
    fields = schema.fields(image=targets.images == "bytes", lidar=targets.lidar)
    sizes = {
        schema.FRAMES: len(frames),
        schema.FRAMES_AND_END: len(frames) + 1,
        schema.BOXES: sum(len(frame.boxes) for frame in frames),
        schema.POINTS: 0,
        schema.ROWS: grid.rows,
        schema.COLUMNS: grid.columns,
    }
    with file.writing() as h5:
        group = h5.create_group(camera)
        for field in fields:
            if field.storage != "whole":
                _describe(group.create_dataset(**_layout(field, sizes, settings.compression)), field)
    tally = _write_frames(file, group, frames, targets, masks)
    with file.writing():
        for field in fields:
            if field.storage == "whole":
                rows = column(field.name, frames, tally.trajectories, tally.points)
                data = np.asarray(rows, field.memory_dtype).reshape(field.resolved(sizes))
                _describe(group.create_dataset(field.name, data=data, dtype=field.h5_dtype), field)
        group.attrs.update(_camera_attributes(camera, tally, len(frames) * grid.rows * grid.columns))


def _write_frames(
    file: ShardFile,
    group: h5py.Group,
    frames: Sequence[FrameRecord],
    settings: TargetSettings,
    masks: MaskStore,
) -> _Tally:
    tally = _Tally([], [])
    map_masks: dict[str, MapMask] = {}
    for index, frame in enumerate(frames):
        if frame.map_path not in map_masks:
            map_masks[frame.map_path] = masks.open(resolve(frame.dataroot, frame.map_path))
        targets = build_targets(frame, settings, map_masks[frame.map_path])
        tally.trajectories.append(targets.trajectory)
        tally.drivable_cells += int(np.count_nonzero(targets.drivable))
        tally.vehicle_cells += int(np.count_nonzero(targets.vehicles))
        with file.writing():
            tally.points.append(_write_frame(group, index, targets))
    return tally


def _write_frame(group: h5py.Group, index: int, targets: FrameTargets) -> int:
    """Store what is stored frame by frame; returns the number of LiDAR points."""
    group["drivable"][index] = targets.drivable
    group["vehicles"][index] = targets.vehicles
    group["field_of_view"][index] = targets.field_of_view
    if targets.image is not None:
        group["image"][index] = np.frombuffer(targets.image, np.uint8)
    if targets.lidar_points is None:
        return 0
    points, count = group["lidar/points"], len(targets.lidar_points)
    points.resize(len(points) + count, axis=0)
    points[len(points) - count :] = targets.lidar_points
    return count


def _layout(field: Field, sizes: dict[str, int], compression: Compression) -> dict[str, Any]:
    """Arguments of `create_dataset` for what is written frame by frame."""
    shape = field.resolved(sizes)
    layout: dict[str, Any] = {"name": field.name, "shape": shape, "dtype": field.h5_dtype}
    if field.storage == "rasters":
        layout |= {"chunks": (1, *shape[1:])} | _FILTERS[compression]
    elif field.storage == "rows":
        chunks = (_POINTS_PER_CHUNK, *shape[1:])
        layout |= {"maxshape": (None, *shape[1:]), "chunks": chunks} | _FILTERS[compression]
    return layout


def _describe(dataset: h5py.Dataset, field: Field) -> None:
    dataset.attrs.update({name: getattr(field, name) for name in schema.DATASET_ATTRIBUTES})


def _camera_attributes(camera: str, tally: _Tally, cells: int) -> dict[str, Any]:
    values: dict[str, Any] = {
        "channel": camera,
        "valid_trajectories": sum(trajectory.valid for trajectory in tally.trajectories),
        "drivable_share": tally.drivable_cells / cells,
        "vehicle_share": tally.vehicle_cells / cells,
    }
    return {attribute.name: attribute.kind(values[attribute.name]) for attribute in schema.CAMERA_ATTRIBUTES}
